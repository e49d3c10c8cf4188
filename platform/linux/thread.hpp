/// A thread with the stack size of the memory page.
#pragma once

#include <pthread.h>

#include <functional>
#include <string>

namespace firstlook {

/// Runs a function on a thread of its own (512 KiB of stack) and joins it at the end of its life. Created at boot only:
/// construction allocates. ENSURE 1605 when the system gives no thread.
class Thread {
 public:
  /// name: at most 15 characters, as `top -H` shows it.
  Thread(std::string name, std::function<void()> body);
  ~Thread();
  Thread(const Thread&) = delete;
  Thread& operator=(const Thread&) = delete;

 private:
  static void* run(void* self);
  std::string name_;
  std::function<void()> body_;
  pthread_t thread_{};
};

/// The calling thread computes for long: whatever priority its process has for the loop's sake, it takes turns with
/// everything else.
void compute_in_the_background() noexcept;

}  // namespace firstlook
