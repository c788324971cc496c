// SPDX-License-Identifier: Apache-2.0
#include "model/gap/confidence.hpp"

#include <array>
#include <catch2/catch.hpp>

namespace confidence_test {

using namespace loopwarden::gap;

namespace {

constexpr std::array kNoise{ConfidenceRow{0.0, 8, 3}, ConfidenceRow{12.0, 18, 15},
                            ConfidenceRow{40.0, 98, 98}};
constexpr std::array kMore{ConfidenceRow{0.0, 18, 9}};
const ConfidenceTable kTable{kNoise, kMore, {0.0, 38, 38}};

}  // namespace

TEST_CASE("a confidence is the share of right names with that lead, by Laplace's rule",
          "[gap][confidence]") {
  CHECK(confidence(0.0, true, kTable) == Approx(0.4));
  CHECK(confidence(11.999, true, kTable) == Approx(0.4));
  CHECK(confidence(12.0, true, kTable) == Approx(0.8));
  CHECK(confidence(39.0, true, kTable) == Approx(0.8));
  CHECK(confidence(40.0, true, kTable) == Approx(0.99));
  CHECK(confidence(1e9, true, kTable) == Approx(0.99));
  CHECK(confidence(-3.0, true, kTable) == Approx(0.4));  // less likely than its rival
  // With a remaining error above noise, the same lead has the share of such cases.
  CHECK(confidence(40.0, false, kTable) == Approx(0.5));
  CHECK(controller_confidence(kTable) == Approx(39.0 / 40.0));
}

TEST_CASE("an outcome that was never seen is not sure", "[gap][confidence]") {
  constexpr std::array kEmpty{ConfidenceRow{}};
  const ConfidenceTable unseen{kEmpty, kEmpty, {}};
  CHECK(confidence(1000.0, true, unseen) == 0.5);
  CHECK(controller_confidence(unseen) == 0.5);
}

TEST_CASE("the kept table rises with the lead and never reaches certainty", "[gap][confidence]") {
  for (const auto& rows : {kConfidenceTable.rest_is_noise, kConfidenceTable.rest_is_more}) {
    REQUIRE_FALSE(rows.empty());
    CHECK(rows.front().from_nats == 0.0);
    const bool noise = rows.data() == kConfidenceTable.rest_is_noise.data();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      CHECK(rows[i].right <= rows[i].names);
      if (i == 0) continue;
      CHECK(rows[i].from_nats > rows[i - 1].from_nats);
      CHECK(confidence(rows[i].from_nats, noise) > confidence(rows[i - 1].from_nats, noise));
    }
    CHECK(confidence(1e9, noise) < 1.0);
  }
  CHECK(kConfidenceTable.rest_is_noise.back().names > 0);
  CHECK(kConfidenceTable.controller.names > 0);
  CHECK(controller_confidence() < 1.0);
}

TEST_CASE("a remaining error within its limits is noise", "[gap][confidence]") {
  CHECK(is_noise(1.0, 3.0, 1.0, false));
  CHECK(is_noise(1.149, 4.99, 5.99, false));
  CHECK_FALSE(is_noise(1.151, 3.0, 1.0, false));
  CHECK_FALSE(is_noise(1.0, 5.01, 1.0, false));
  CHECK_FALSE(is_noise(1.0, 3.0, 6.01, false));
  CHECK_FALSE(is_noise(1.0, 3.0, 1.0, true));
}

}  // namespace confidence_test
