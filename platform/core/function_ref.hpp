/// A reference to something callable: no allocation, no ownership (std::function_ref of C++26 in its simplest form).
#pragma once

#include <memory>
#include <type_traits>
#include <utility>

namespace firstlook {

template <typename Signature>
class FunctionRef;

/// Valid as long as the callable that it was made from.
template <typename R, typename... Args>
class FunctionRef<R(Args...)> {
 public:
  template <typename Callable>
    requires(!std::is_same_v<std::remove_cvref_t<Callable>, FunctionRef> &&
             std::is_invocable_r_v<R, Callable&, Args...>)
  FunctionRef(Callable&& callable)  // NOLINT(google-explicit-constructor): made at the call, like the standard's
      : object_(const_cast<void*>(static_cast<const void*>(std::addressof(callable)))),
        call_([](void* object, Args... args) -> R {
          return (*static_cast<std::remove_reference_t<Callable>*>(object))(std::forward<Args>(args)...);
        }) {}

  R operator()(Args... args) const { return call_(object_, std::forward<Args>(args)...); }

 private:
  void* object_;
  R (*call_)(void*, Args...);
};

}  // namespace firstlook
