/// How a pure function asks its caller to spread work over threads, without knowing of threads.
#pragma once

#include <type_traits>
#include <utility>

namespace firstlook {

/// A callable that somebody else owns, for the length of one call. Two pointers; never allocates.
template <typename Signature>
class FunctionRef;

template <typename R, typename... Args>
class FunctionRef<R(Args...)> {
 public:
  template <typename F>
    requires(!std::is_same_v<std::remove_cvref_t<F>, FunctionRef> && std::is_invocable_r_v<R, F&, Args...>)
  FunctionRef(F&& callable)  // NOLINT(google-explicit-constructor): passing a lambda is the point
      : object_(const_cast<void*>(static_cast<const void*>(&callable))), call_([](void* object, Args... args) -> R {
          return (*static_cast<std::remove_reference_t<F>*>(object))(std::forward<Args>(args)...);
        }) {}
  R operator()(Args... args) const { return call_(object_, std::forward<Args>(args)...); }

 private:
  void* object_;
  R (*call_)(void*, Args...);
};

/// body(index, worker): worker is 0 .. workers - 1, and no two calls at one time have the same.
using IndexedBody = FunctionRef<void(int index, int worker)>;

/// run(n, body) calls body once for each index in [0, n), in any order and on any of its workers, and returns when all
/// are done. Results must not depend on the number of workers: each index writes to its own place.
using RunParallel = FunctionRef<void(int n, IndexedBody body)>;

/// RunParallel on the calling thread alone.
inline void run_serially(int n, IndexedBody body) {
  for (int i = 0; i < n; ++i) body(i, 0);
}

}  // namespace firstlook
