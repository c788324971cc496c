// SPDX-License-Identifier: Apache-2.0
#include "base/signals.hpp"

#include <algorithm>
#include <csignal>

namespace loopwarden::base {
namespace {

sigset_t set_of(std::initializer_list<int> numbers) {
  sigset_t set;
  sigemptyset(&set);
  for (const int number : numbers) sigaddset(&set, number);
  return set;
}

}  // namespace

void block_signals(std::initializer_list<int> numbers) {
  const sigset_t set = set_of(numbers);
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

int wait_for_signal(std::initializer_list<int> numbers, std::chrono::nanoseconds patience) {
  const sigset_t set = set_of(numbers);
  const auto whole = std::chrono::duration_cast<std::chrono::seconds>(patience);
  const timespec time{whole.count(), (patience - whole).count()};
  return std::max(0, sigtimedwait(&set, nullptr, &time));
}

}  // namespace loopwarden::base
