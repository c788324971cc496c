// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/posterior_bars.hpp"

#include <catch2/catch.hpp>

namespace loopwarden::tests::posterior_bars_test {

TEST_CASE("the likeliest hypotheses, the others and none of these are bars", "[gap]") {
  using workbench::posterior_bars;
  CHECK(posterior_bars({}, 3).empty());
  const auto bars = posterior_bars(
      {{{"stiction", "gain_change"}, 0.6}, {{}, 0.2}, {{"unnamed"}, 0.1}, {{"drift"}, 0.1}}, 2);
  REQUIRE(bars.size() == 4);
  CHECK(bars[0].title == "stiction + gain change");
  CHECK(bars[0].named);
  CHECK(bars[1].title == "nothing missing");
  CHECK(bars[2].title == "others");
  CHECK(bars[2].probability == 0.1);
  CHECK(bars[3].title == "none of these");
  CHECK(bars[3].probability == 0.1);
  // It is a bar if its probability is 0, too.
  CHECK(posterior_bars({{{"stiction"}, 1.0}}, 2).back().title == "none of these");
}

}  // namespace loopwarden::tests::posterior_bars_test
