// SPDX-License-Identifier: Apache-2.0
#include "config/interlocks.hpp"

#include <catch2/catch.hpp>
#include <string>

namespace interlocks_test {

using namespace loopwarden;
using namespace loopwarden::config;
using control::JacketForm;

TEST_CASE("What is behind a loop follows from its backend", "[config][interlocks]") {
  CHECK_FALSE(backing_of(SimIo{}).hardware);
  CHECK(backing_of(hal::modbus::LoopModbusSettings{}).hardware);
  CHECK(backing_of(hal::iio::AnalogSettings{}).hardware);
  CHECK_FALSE(backing_of(hal::replay::ReplaySettings{}).hardware);
}

TEST_CASE("The form paper acts in no running loop", "[config][interlocks]") {
  const control::JacketSettings paper{.form = JacketForm::paper, .max_mean_error = 1.0};
  CHECK(interlocks_of(paper, {}).paper);
  CHECK(interlocks_of(paper, {.hardware = true}).paper);
  CHECK_FALSE(interlocks_of({.form = JacketForm::dwell}, {}).paper);
}

TEST_CASE("On hardware a jacket acts with max_mean_error only, a compensator with its limit only",
          "[config][interlocks]") {
  control::JacketSettings jacket{.form = JacketForm::bounded};
  CHECK(interlocks_of(jacket, {.hardware = true}).max_mean_error);
  CHECK(interlocks_of(jacket, {}).none());
  jacket.max_mean_error = 2.0;
  CHECK(interlocks_of(jacket, {.hardware = true}).none());

  control::CompensatorSettings c{.kind = control::CompensatorKind::backlash};
  CHECK(lacks(c, {.hardware = true}) == std::string("limit"));
  CHECK_FALSE(lacks(c, {}));
  c.shadow = true;
  CHECK_FALSE(lacks(c, {.hardware = true}));
  c = {.kind = control::CompensatorKind::backlash, .limit = 0.5};
  CHECK_FALSE(lacks(c, {.hardware = true}));
  CHECK_FALSE(lacks({}, {.hardware = true}));
}

TEST_CASE("On hardware planned_moves acts with its limits and a narrow interval of s only",
          "[config][interlocks]") {
  control::CompensatorSettings c{.kind = control::CompensatorKind::planned_moves};
  c.planned.s_low = c.planned.s_high = 1.0;
  const auto missing = [&](Backing backing) {
    const char* key = lacks(c, backing);
    return std::string(key == nullptr ? "" : key);
  };
  CHECK(missing({}) == "");
  CHECK(missing({.hardware = true}) == "max_move");
  c.planned.max_move = 2.0;
  CHECK(missing({.hardware = true}) == "max_moves_per_hour");
  c.planned.max_moves_per_hour = 60.0;
  CHECK(missing({.hardware = true}) == "s_interval");
  c.planned.s_high = 1.9;
  CHECK(missing({.hardware = true}) == "");
  CHECK_FALSE(too_wide(c, {.hardware = true}));
  c.planned.s_high = 2.1;
  CHECK(too_wide(c, {.hardware = true}));
  CHECK_FALSE(too_wide(c, {}));
  c.shadow = true;
  CHECK_FALSE(too_wide(c, {.hardware = true}));
}

}  // namespace interlocks_test
