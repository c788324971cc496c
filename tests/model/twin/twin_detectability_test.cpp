// SPDX-License-Identifier: Apache-2.0
#include "model/twin/twin_detectability.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>

#include "tests/model/gap/gap_support.hpp"

namespace twin_detectability_test {

using namespace loopwarden;
using twin::TwinSeen;
using twin::TwinSees;

plant::LoopModel twin_model() {
  plant::LoopModel twin = test::believed_model();
  twin.transmitter.noise = 0.015;
  twin.scenario.set_point = {{0.0, 4.0}, {60.0, 6.0}, {180.0, 4.5}, {240.0, 5.5}};
  twin.scenario.duration_s = 300.0;
  twin.twin.emplace();
  twin.twin->seen_low = 3.0;
  twin.twin->seen_high = 7.0;
  twin.twin->co_low = 0.0;
  twin.twin->co_high = 10.0;
  twin.twin->controller = plant::SeenController{.rms = 0.001, .resolution = 10.0 / 4096.0};
  return twin;
}

TwinSeen of(const std::vector<TwinSeen>& all, TwinSees change) {
  return *std::find_if(all.begin(), all.end(), [&](const auto& s) { return s.change == change; });
}

TEST_CASE("the smallest change that the twin detects is larger if SP moves less",
          "[commission][twin]") {
  const auto moving = twin::look_by_twin(twin_model(), 1, test::serial);
  REQUIRE(moving.size() == 4);
  plant::LoopModel little = twin_model();
  for (auto& [time_s, set_point] : little.scenario.set_point) {
    set_point = 5.0 + 0.1 * (set_point - 5.0);
  }
  const auto hardly = twin::look_by_twin(little, 1, test::serial);
  for (const TwinSees change : {TwinSees::gain, TwinSees::dead_time, TwinSees::lag}) {
    INFO(to_text(change));
    REQUIRE(of(moving, change).size);
    const double never = std::numeric_limits<double>::infinity();
    CHECK(*of(moving, change).size < of(hardly, change).size.value_or(never));
  }
  CHECK(*of(moving, TwinSees::gain).size <= 0.2);
  CHECK(*of(moving, TwinSees::controller).size <= 0.5);
  plant::LoopModel still = twin_model();
  still.scenario.set_point = {{0.0, 5.0}};
  const auto standing = twin::look_by_twin(still, 1, test::serial);
  CHECK_FALSE(of(standing, TwinSees::dead_time).size);
}

TEST_CASE("no detectability is reported for a controller that is not watched",
          "[commission][twin]") {
  plant::LoopModel twin = twin_model();
  twin.scenario.set_point = {{0.0, 5.0}};
  twin.twin->controller.reset();
  const auto seen = twin::look_by_twin(twin, 1, test::serial);
  CHECK(seen.size() == 3);
}

}  // namespace twin_detectability_test
