// SPDX-License-Identifier: Apache-2.0
#include "workbench/records/recorder_input.hpp"

#include <catch2/catch.hpp>

namespace loopwarden::workbench::recorder_input_test {

TEST_CASE("a time is a number with its unit", "[records]") {
  CHECK(seconds_of("4h") == 14'400.0);
  CHECK(seconds_of("90min") == 5400.0);
  CHECK(seconds_of("1.5d") == 129'600.0);
  CHECK(seconds_of("45s") == 45.0);
  for (const char* wrong : {"", "4", "h", "0h", "-1h", "4 h", "4hours", "infh", "nanh", "4h "}) {
    INFO(wrong);
    CHECK_FALSE(seconds_of(wrong));
  }
}

}  // namespace loopwarden::workbench::recorder_input_test
