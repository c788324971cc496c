// SPDX-License-Identifier: Apache-2.0
#include "base/signals.hpp"

#include <catch2/catch.hpp>

#include <pthread.h>

#include <chrono>
#include <csignal>
#include <thread>

namespace loopwarden::signals_test {

using namespace std::chrono_literals;

TEST_CASE("a blocked signal waits until it is taken, once") {
  int none = -1;
  int got = -1;
  int again = -1;
  std::thread([&] {
    base::block_signals({SIGUSR1, SIGUSR2});
    none = base::wait_for_signal({SIGUSR1, SIGUSR2}, 0ms);
    ::pthread_kill(::pthread_self(), SIGUSR1);
    got = base::wait_for_signal({SIGUSR1, SIGUSR2}, 10s);
    again = base::wait_for_signal({SIGUSR1, SIGUSR2}, 20ms);
  }).join();
  CHECK(none == 0);
  CHECK(got == SIGUSR1);
  CHECK(again == 0);
}

}  // namespace loopwarden::signals_test
