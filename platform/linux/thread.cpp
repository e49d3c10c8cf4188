#include "platform/linux/thread.hpp"

#include <sched.h>

#include <csignal>
#include <utility>

#include "platform/core/ensure.hpp"
#include "platform/memory/budget.hpp"

namespace firstlook {

Thread::Thread(std::string name, std::function<void()> body) : name_(std::move(name)), body_(std::move(body)) {
  pthread_attr_t attributes;
  ENSURE(1603, pthread_attr_init(&attributes) == 0);
  ENSURE(1604, pthread_attr_setstacksize(&attributes, memory::kThreadStackBytes) == 0);
  // Signals belong to the loop thread: they have to end its wait.
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  const int created = pthread_create(&thread_, &attributes, &Thread::run, this);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  pthread_attr_destroy(&attributes);
  ENSURE(1605, created == 0);
}

Thread::~Thread() { pthread_join(thread_, nullptr); }

void* Thread::run(void* self) {
  Thread& thread = *static_cast<Thread*>(self);
  pthread_setname_np(pthread_self(), thread.name_.c_str());
  thread.body_();
  return nullptr;
}

void compute_in_the_background() noexcept {
  const sched_param none{};
  (void)pthread_setschedparam(pthread_self(), SCHED_OTHER, &none);
}

}  // namespace firstlook
