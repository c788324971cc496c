// SPDX-License-Identifier: Apache-2.0
#include "base/blocking/blocking_worker.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

namespace blocking_worker_test {

using loopwarden::base::BlockingWorker;

namespace {

// A listing can miss a thread while others end, so the largest of several counts.
int threads_called(const std::string& name) {
  int most = 0;
  for (int listing = 0; listing < 10; ++listing) {
    int count = 0;
    for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
      std::ifstream file(task.path() / "comm");
      std::string one;
      if (std::getline(file, one) && one == name) ++count;
    }
    most = std::max(most, count);
  }
  return most;
}

}  // namespace

TEST_CASE("several first requests at the same time share one thread") {
  for (int round = 0; round < 200; ++round) {
    BlockingWorker task("t-errand");
    std::atomic<int> ready{0};
    std::atomic<int> answered{0};
    std::array<std::thread, 4> all;
    for (std::thread& one : all) {
      one = std::thread([&] {
        ++ready;
        while (ready < static_cast<int>(all.size())) std::this_thread::yield();
        if (task.ask<int>([] { return 1; }, std::chrono::minutes(1)) == 1) ++answered;
      });
    }
    for (std::thread& one : all) one.join();
    REQUIRE(answered == static_cast<int>(all.size()));
    REQUIRE(threads_called("t-errand") == 1);
  }
}

}  // namespace blocking_worker_test
