/// Where writers put their bytes: algorithms do no I/O, the caller does.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <type_traits>

namespace firstlook {

/// A reference to a callable that takes a span of bytes. Does not own it: the callable must outlive the call that it is
/// passed to. The callable keeps its own record of failures.
class ByteSink {
 public:
  template <typename F>
    requires(!std::is_same_v<std::remove_cvref_t<F>, ByteSink>)
  ByteSink(F&& f)  // NOLINT: meant to convert
      : target_(const_cast<void*>(static_cast<const void*>(std::addressof(f)))),
        call_([](void* target, std::span<const std::byte> bytes) {
          (*static_cast<std::remove_reference_t<F>*>(target))(bytes);
        }) {}
  void operator()(std::span<const std::byte> bytes) const { call_(target_, bytes); }

 private:
  void* target_;
  void (*call_)(void*, std::span<const std::byte>);
};

}  // namespace firstlook
