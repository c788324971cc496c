// SPDX-License-Identifier: Apache-2.0
#include "base/thread.hpp"

#include <sched.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <system_error>
#include <thread>
#include <utility>

namespace loopwarden::base {
namespace {

void* run(void* argument) {
  const std::unique_ptr<std::function<void()>> body(static_cast<std::function<void()>*>(argument));
  (*body)();
  return nullptr;
}

}  // namespace

std::string Thread::start(const ThreadOptions& options, std::function<void()> body) {
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, options.stack_bytes);
  auto owned = std::make_unique<std::function<void()>>(std::move(body));
  std::string refused;
  int error = EPERM;
  if (options.fifo_priority > 0) {
    // The priority is set before the thread starts: on a loaded machine it could wait long for a
    // later change.
    const sched_param parameters{options.fifo_priority};
    pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
    pthread_attr_setschedpolicy(&attributes, SCHED_FIFO);
    pthread_attr_setschedparam(&attributes, &parameters);
    error = pthread_create(&handle_, &attributes, run, owned.get());
    if (error == EPERM) {
      refused = "real-time priority " + std::to_string(options.fifo_priority) + " refused (" +
                std::strerror(error) + ")";
      pthread_attr_setinheritsched(&attributes, PTHREAD_INHERIT_SCHED);
    }
  }
  if (error == EPERM) error = pthread_create(&handle_, &attributes, run, owned.get());
  pthread_attr_destroy(&attributes);
  if (error != 0) throw std::system_error(error, std::generic_category(), "thread " + options.name);
  owned.release();  // NOLINT(bugprone-unused-return-value): the new thread owns it now
  started_ = true;
  pthread_setname_np(handle_, options.name.substr(0, 15).c_str());
  if (options.cpu) {
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(static_cast<std::size_t>(*options.cpu), &set);
    const int e = pthread_setaffinity_np(handle_, sizeof set, &set);
    if (e != 0) {
      refused += (refused.empty() ? "" : "; ") + std::string("CPU ") +
                 std::to_string(*options.cpu) + " refused (" + std::strerror(e) + ")";
    }
  }
  return refused;
}

void Thread::join() noexcept {
  if (!started_) return;
  pthread_join(handle_, nullptr);
  started_ = false;
}

bool Thread::join_for(std::chrono::milliseconds patience) noexcept {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (started_) {
    if (pthread_tryjoin_np(handle_, nullptr) == 0) {
      started_ = false;
      return true;
    }
    if (std::chrono::steady_clock::now() >= deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

}  // namespace loopwarden::base
