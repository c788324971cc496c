// SPDX-License-Identifier: Apache-2.0
#include "model/effects/stiction/stiction_choudhury.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "model/effects/backlash/backlash.hpp"
#include "model/numeric/random.hpp"

namespace stiction_choudhury_test {

using namespace loopwarden;
using namespace loopwarden::effects;

namespace {

// The paper's flow chart, relative to the command at which the stem stuck. The stem breaks loose
// after S more following a reversal, or J more in the same direction. While it moves, its offset is
// (S - J) / 2.
class FlowChart {
 public:
  FlowChart(double s, double j, double u) : s_(s), j_(j), u_(u), stuck_at_(u), x_(u) {}

  double step(double u) {
    const double change = u - u_;
    if (moving_ && change * came_from_ <= 0.0) {
      moving_ = false;
      stuck_at_ = u_;
    }
    if (!moving_) {
      const double further = (u - stuck_at_) * came_from_;  // onwards in the previous direction
      const double needed = further > 0.0 ? j_ : s_;
      if (std::abs(u - stuck_at_) > needed) {
        moving_ = true;
        came_from_ = u > stuck_at_ ? 1.0 : -1.0;
      }
    }
    if (moving_) x_ = u - came_from_ * (s_ - j_) / 2.0;
    u_ = u;
    return x_;
  }

  // Starts in the state after a move upwards and a stop.
  void came_upwards() {
    came_from_ = 1.0;
    x_ = u_ - (s_ - j_) / 2.0;
  }
  double stem() const { return x_; }

 private:
  double s_, j_, u_, stuck_at_, x_;
  double came_from_ = 0.0;
  bool moving_ = false;
};

// Moves both laws from rest at 0 upwards, and stops them at u = 20.
void bring_upwards(StictionChoudhury& law) {
  law.reset(0.0);
  for (double u = 1.0; u <= 20.0; u += 1.0) law.step(u);
  law.step(20.0);
}

}  // namespace

TEST_CASE("the law is the paper's flow chart", "[plant][stiction]") {
  struct Case {
    double s, j;
  };
  const auto c = GENERATE(Case{5.0, 0.0}, Case{5.0, 1.0}, Case{5.0, 2.5}, Case{5.0, 5.0});
  CAPTURE(c.s, c.j);
  StictionChoudhury law({c.s, c.j});
  bring_upwards(law);
  FlowChart chart(c.s, c.j, 20.0);
  chart.came_upwards();
  REQUIRE(law.step(20.0) == Approx(chart.stem()));

  // Slow sines, steps, stops and a random walk; sums that never hit a threshold exactly.
  loopwarden::numeric::Random random(5);
  double u = 20.0;
  int moved = 0;
  double last = chart.stem();
  for (int k = 0; k < 20'000; ++k) {
    if (k < 5000) u = 20.0 + 13.3 * std::sin(0.0117 * k) + 2.7 * std::sin(0.0731 * k);
    if (k >= 5000 && k < 10'000 && k % 97 == 0) u = 20.0 + 11.0 * (random.uniform() - 0.5);
    if (k >= 10'000) u += 0.3 * random.normal();
    const double expected = chart.step(u);
    REQUIRE(law.step(u) == Approx(expected).margin(1e-9));
    if (expected != last) ++moved;
    last = expected;
  }
  CHECK(moved > 1000);
}

TEST_CASE("S after a reversal, J after a stop, and the jump between", "[plant][stiction]") {
  StictionChoudhury law({5.0, 2.0});
  bring_upwards(law);
  CHECK(law.step(20.0) == 18.5);  // lags by (S - J) / 2
  SECTION("reversal") {
    CHECK(law.step(15.01) == 18.5);
    CHECK(law.step(14.99) == Approx(14.99 + 1.5));  // jumped by J
    CHECK(law.step(14.0) == Approx(15.5));          // then follows one to one
  }
  SECTION("same direction") {
    CHECK(law.step(21.99) == 18.5);
    CHECK(law.step(22.01) == Approx(22.01 - 1.5));
    CHECK(law.step(23.0) == Approx(21.5));
  }
}

TEST_CASE("without a slip jump it is a play of width S", "[plant][stiction]") {
  StictionChoudhury law({4.0, 0.0});
  Backlash play(4.0);
  law.reset(10.0);
  play.reset(10.0);
  loopwarden::numeric::Random random(2);
  double u = 10.0;
  for (int k = 0; k < 20'000; ++k) {
    u += 0.4 * random.normal();
    REQUIRE(law.step(u) == Approx(play.step(u)).margin(1e-9));
  }
}

TEST_CASE("with J = S the moving stem is where the command is", "[plant][stiction]") {
  StictionChoudhury law({3.0, 3.0});
  law.reset(0.0);
  CHECK(law.step(2.9) == 0.0);
  CHECK(law.step(3.1) == Approx(3.1));
  CHECK(law.step(8.0) == Approx(8.0));
  CHECK(law.step(5.1) == Approx(8.0));
  CHECK(law.step(4.9) == Approx(4.9));
}

TEST_CASE("at rest the stem is where the command is", "[plant][stiction]") {
  StictionChoudhury law({5.0, 2.0});
  CHECK(law.reset(33.0) == 33.0);
  CHECK(law.step(33.0) == 33.0);
  CHECK(law.step(36.4) == 33.0);
  CHECK(law.step(36.6) == Approx(35.1));
}

TEST_CASE("severity scales S and J; at 0 the valve is healthy", "[plant][stiction]") {
  StictionChoudhury half({5.0, 2.0});
  half.set_severity(0.5);
  StictionChoudhury small({2.5, 1.0});
  half.reset(0.0);
  small.reset(0.0);
  for (int k = 0; k < 1000; ++k) {
    const double u = 6.0 * std::sin(0.02 * k);
    REQUIRE(half.step(u) == small.step(u));
  }
  half.set_severity(0.0);
  for (const double u : {3.0, -4.0, -4.0, 0.7}) CHECK(half.step(u) == u);
}

TEST_CASE("a CO that is not finite leaves the stem where it is", "[plant][stiction]") {
  const double bad = GENERATE(
      values({std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}));
  StictionChoudhury law({5.0, 2.0});
  law.reset(0.0);
  const double moving = law.step(10.0);
  CHECK(law.step(bad) == moving);
  CHECK(law.step(12.0) == Approx(10.5));
}

}  // namespace stiction_choudhury_test
