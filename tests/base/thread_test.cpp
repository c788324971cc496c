// SPDX-License-Identifier: Apache-2.0
#include "base/thread.hpp"

#include <pthread.h>
#include <sched.h>

#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <cstddef>
#include <string>
#include <system_error>
#include <thread>

namespace thread_test {

using namespace loopwarden::base;

namespace {

// Properties of the started thread, which it reads after start() has set them.
struct Seen {
  std::string name;
  int policy = -1;
  int priority = -1;
  int cpus = 0;
  bool first_cpu = false;
  std::size_t stack_bytes = 0;
};

Seen look() {
  Seen seen;
  std::array<char, 32> name{};
  pthread_getname_np(pthread_self(), name.data(), name.size());
  seen.name = name.data();
  sched_param parameters{};
  pthread_getschedparam(pthread_self(), &seen.policy, &parameters);
  seen.priority = parameters.sched_priority;
  cpu_set_t set;
  CPU_ZERO(&set);
  pthread_getaffinity_np(pthread_self(), sizeof set, &set);
  seen.cpus = CPU_COUNT(&set);
  seen.first_cpu = CPU_ISSET(0, &set);
  pthread_attr_t attributes;
  pthread_getattr_np(pthread_self(), &attributes);
  pthread_attr_getstacksize(&attributes, &seen.stack_bytes);
  pthread_attr_destroy(&attributes);
  return seen;
}

struct Started {
  std::string refused;
  Seen seen;
};

Started start(const ThreadOptions& options) {
  Started result;
  std::atomic<bool> set_up{false};
  Thread thread;
  result.refused = thread.start(options, [&] {
    while (!set_up.load()) std::this_thread::yield();
    result.seen = look();
  });
  set_up.store(true);
  thread.join();
  return result;
}

}  // namespace

TEST_CASE("a thread runs its body and is joined", "[os][thread]") {
  std::atomic<int> runs{0};
  Thread thread;
  CHECK_FALSE(thread.running());
  CHECK(thread.start({.name = "worker"}, [&] { ++runs; }).empty());
  CHECK(thread.running());
  thread.join();
  CHECK_FALSE(thread.running());
  CHECK(runs == 1);
  thread.join();  // has no effect

  SECTION("and can be started again") {
    thread.start({.name = "worker"}, [&] { ++runs; });
    thread.join();
    CHECK(runs == 2);
  }
}

TEST_CASE("its destructor waits for it", "[os][thread]") {
  std::atomic<bool> may_end{false};
  std::atomic<bool> ended{false};
  {
    Thread thread;
    thread.start({.name = "worker"}, [&] {
      while (!may_end.load()) std::this_thread::yield();
      ended.store(true);
    });
    may_end.store(true);
  }
  CHECK(ended);
}

TEST_CASE("it has its name, shortened to the length that the kernel accepts", "[os][thread]") {
  CHECK(start({.name = "bus:valve-2"}).seen.name == "bus:valve-2");
  CHECK(start({.name = "a-name-that-is-too-long"}).seen.name == "a-name-that-is-");
}

TEST_CASE("it has the requested stack, and ordinary scheduling unless requested otherwise",
          "[os][thread]") {
  const Started started = start({.name = "worker", .stack_bytes = 512 * 1024});
  CHECK(started.refused.empty());
  CHECK(started.seen.stack_bytes >= 512 * 1024);
  CHECK(started.seen.stack_bytes < 1024 * 1024);  // a sanitizer adds its own size
  CHECK(started.seen.policy == SCHED_OTHER);
}

TEST_CASE("real-time priority is granted, or refused with a reason while the thread continues",
          "[os][thread]") {
  const Started started = start({.name = "worker", .fifo_priority = 10});
  if (started.refused.empty()) {
    CHECK(started.seen.policy == SCHED_FIFO);
    CHECK(started.seen.priority == 10);
  } else {
    CHECK(started.refused.find("priority 10 refused") != std::string::npos);
    CHECK(started.seen.policy == SCHED_OTHER);
  }
}

TEST_CASE("real-time priority is set from its first instruction on", "[os][thread]") {
  for (int i = 0; i < 50; ++i) {
    std::atomic<int> policy{-1};
    Thread thread;
    const std::string refused = thread.start({.name = "worker", .fifo_priority = 10},
                                             [&] { policy = sched_getscheduler(0); });
    thread.join();
    REQUIRE(policy == (refused.empty() ? SCHED_FIFO : SCHED_OTHER));
  }
}

TEST_CASE("a CPU is granted, or refused with a reason while the thread continues", "[os][thread]") {
  const Started first = start({.name = "worker", .cpu = 0});
  if (first.refused.empty()) {
    CHECK(first.seen.cpus == 1);
    CHECK(first.seen.first_cpu);
  }
  // This CPU does not exist.
  const Started none = start({.name = "worker", .cpu = CPU_SETSIZE - 1});
  CHECK(none.refused.find("CPU 1023 refused") != std::string::npos);
  CHECK(none.seen.name == "worker");
}

TEST_CASE("a thread that can't be created is an error", "[os][thread]") {
  Thread thread;
  CHECK_THROWS_AS(thread.start({.name = "giant", .stack_bytes = std::size_t{1} << 60U}, [] {}),
                  std::system_error);
  CHECK_FALSE(thread.running());
}

}  // namespace thread_test
