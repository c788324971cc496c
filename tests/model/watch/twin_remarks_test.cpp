// SPDX-License-Identifier: Apache-2.0
#include "model/watch/twin_remarks.hpp"

#include <catch2/catch.hpp>

namespace twin_remarks_test {

using namespace loopwarden;
using namespace loopwarden::alarm;
using namespace loopwarden::watch;
using Kind = TwinNews::Kind;

TEST_CASE("a load outside is reported when it begins and when it ends", "[twin]") {
  TwinNews news;
  TwinRemarks now{.judging = Judging::here};
  CHECK_FALSE(news.add(now, 1.0));
  now.load = LoadOutside{.size = 0.6, .since_s = 1.0};
  CHECK(news.add(now, 1.0) == Kind::load_outside);
  now.load->size = 0.9;
  CHECK_FALSE(news.add(now, 1.0));
  now.load.reset();
  CHECK(news.add(now, 1.0) == Kind::load_back);
}

TEST_CASE("a loop that is not judged is reported once it lasts, and again when it is judged",
          "[twin]") {
  TwinNews news;
  const TwinRemarks here{.judging = Judging::here};
  const TwinRemarks outside{.judging = Judging::outside};
  const TwinRemarks settling{.judging = Judging::settling};
  // Moves that leave the healthy range for a while are not journalled.
  for (int i = 0; i < 10; ++i) {
    CHECK_FALSE(news.add(outside, 500.0));
    CHECK_FALSE(news.add(here, 1.0));
  }
  CHECK_FALSE(news.add(outside, 500.0));
  CHECK(news.add(settling, 100.0) == Kind::not_judged);
  CHECK_FALSE(news.add(outside, 5000.0));
  CHECK(news.add(here, 1.0) == Kind::judged_again);
}

}  // namespace twin_remarks_test
