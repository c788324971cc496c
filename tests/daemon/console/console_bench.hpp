// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <catch2/catch.hpp>

#include "tests/daemon/console/console.hpp"
#include "tests/support/device/foreign_process.hpp"

namespace loopwarden::daemon::console_bench {

struct Bench : Console {
  using Console::Console;

  // Waits for `count` journal lines; returns them oldest first.
  std::vector<json> lines(std::size_t count) {
    std::vector<json> found;
    CHECK(test::eventually([&] {
      const json answer = ask(R"({"request": "journal", "most": 50})");
      found.assign(answer.at("lines").rbegin(), answer.at("lines").rend());
      return found.size() >= count;
    }));
    CHECK(found.size() == count);
    return found;
  }
};

}  // namespace loopwarden::daemon::console_bench
