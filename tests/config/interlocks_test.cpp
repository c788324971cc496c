// SPDX-License-Identifier: Apache-2.0
#include "config/interlocks.hpp"

#include <catch2/catch.hpp>

namespace interlocks_test {

using namespace loopwarden;
using namespace loopwarden::config;
using control::JacketForm;

TEST_CASE("What is behind a loop follows from its backend", "[config][interlocks]") {
  CHECK(backing_of(SimIo{}).simulated);
  CHECK_FALSE(backing_of(SimIo{}).hardware);
  CHECK(backing_of(hal::modbus::LoopModbusSettings{}).hardware);
  CHECK(backing_of(hal::iio::AnalogSettings{}).hardware);
  const Backing replay = backing_of(hal::replay::ReplaySettings{});
  CHECK_FALSE(replay.hardware);
  CHECK_FALSE(replay.simulated);
}

TEST_CASE("The form paper acts in simulation only", "[config][interlocks]") {
  const control::JacketSettings paper{.form = JacketForm::paper, .max_mean_error = 1.0};
  CHECK(interlocks_of(paper, {.simulated = true}).none());
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
  CHECK(lacks_limit(c, {.hardware = true}));
  CHECK_FALSE(lacks_limit(c, {.simulated = true}));
  CHECK_FALSE(lacks_limit(c, {}));
  c.shadow = true;
  CHECK_FALSE(lacks_limit(c, {.hardware = true}));
  c = {.kind = control::CompensatorKind::backlash, .limit = 0.5};
  CHECK_FALSE(lacks_limit(c, {.hardware = true}));
  CHECK_FALSE(lacks_limit({}, {.hardware = true}));
}

}  // namespace interlocks_test
