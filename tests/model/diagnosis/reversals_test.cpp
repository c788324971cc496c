// SPDX-License-Identifier: Apache-2.0
// Tests the cause of the reversals of CO, and the effect of a limit.
#include "model/diagnosis/reversals.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <utility>
#include <vector>

#include "model/diagnosis/preparation.hpp"
#include "model/numeric/random.hpp"
#include "tests/model/diagnosis/signals.hpp"

namespace loopwarden::tests::reversals_test {
namespace {

using namespace diagnosis;

// Straight moves up and down, with random travel and length.
template <class Travel, class Length>
Series zigzag(std::size_t moves, Travel travel, Length length) {
  Series co{0.0};
  for (std::size_t m = 0; m < moves; ++m) {
    const double from = co.back();
    const double by = (m % 2 == 0 ? 1.0 : -1.0) * travel();
    const auto samples = static_cast<std::size_t>(length());
    for (std::size_t k = 1; k <= samples; ++k) {
      co.push_back(from + by * static_cast<double>(k) / static_cast<double>(samples));
    }
  }
  return co;
}

TEST_CASE(
    "CO that reverses after a band reverses by travel, CO that a swing drives reverses by time") {
  numeric::Random random(3);
  const auto constant = [](double value) { return [value] { return value; }; };
  const auto drawn = [&](double low, double high) {
    return [&random, low, high] { return low + (high - low) * random.uniform(); };
  };
  const Reversals valve = find_reversals(zigzag(40, constant(4.0), drawn(8.0, 30.0)));
  CHECK(valve.by() == ReversalsBy::travel);
  CHECK(valve.count == Approx(39).margin(2));
  CHECK(valve.travel_scatter < 0.05);
  CHECK(valve.cycle_scatter > 0.2);
  Series swing;
  for (std::size_t cycle = 0; cycle < 20; ++cycle) {
    const double size = 2.0 + 2.0 * random.uniform();
    const double samples = 36.0 + 8.0 * random.uniform();
    for (double k = 0.0; k < samples; k += 1.0) swing.push_back(size * sine(k / samples));
  }
  CHECK(find_reversals(swing).by() == ReversalsBy::time);
  CHECK(find_reversals(zigzag(5, constant(4.0), drawn(8.0, 30.0))).by() == ReversalsBy::neither);
  CHECK(find_reversals(Series(100, 1.0)).count == 0);
}

TEST_CASE("a cycle whose travel and time scatter alike is a swing only while it keeps its phase") {
  numeric::Random random(11);
  double end = 2.0;  // of the last move, from the middle
  const auto travel = [&] {
    const double before = std::exchange(end, 2.0 * (0.7 + 0.6 * random.uniform()));
    return before + end;
  };
  const auto forgotten = [&] { return std::round(40.0 * (0.65 + 0.7 * random.uniform())); };
  double late = 0.0;
  const auto kept = [&] {
    const double before = std::exchange(late, 27.0 * random.uniform() - 13.5);
    return 40.0 + std::round(late) - std::round(before);
  };
  const Reversals limit_cycle = find_reversals(zigzag(120, travel, forgotten));
  const Reversals swing = find_reversals(zigzag(120, travel, kept));
  for (const Reversals& reversals : {limit_cycle, swing}) {
    CHECK(reversals.cycle_scatter > 0.8 * reversals.travel_scatter);
    CHECK(reversals.cycle_scatter < 1.1 * reversals.travel_scatter);
  }
  CHECK(limit_cycle.by() == ReversalsBy::neither);
  CHECK(swing.by() == ReversalsBy::time);
}

TEST_CASE("an external oscillation keeps its phase, a limit cycle forgets it") {
  numeric::Random random(5);
  const auto constant = [] { return 4.0; };
  // Reversals up to an eightieth of a cycle early or late, relative to the times of an external
  // clock.
  double late = 0.0;
  const auto kept = [&] {
    const double before = std::exchange(late, 2.0 * random.uniform() - 1.0);
    return 40.0 + std::round(late) - std::round(before);
  };
  CHECK(find_reversals(zigzag(120, constant, kept)).by() == ReversalsBy::clockwork);
  // At most twice as late, but each reversal counts from the previous one.
  const auto forgotten = [&] { return 40.0 + std::round(4.0 * random.uniform() - 2.0); };
  const Reversals limit_cycle = find_reversals(zigzag(120, constant, forgotten));
  CHECK(limit_cycle.cycle_scatter < 0.06);
  CHECK(limit_cycle.by() == ReversalsBy::neither);
  // Too few cycles for a verdict.
  CHECK(find_reversals(zigzag(12, constant, [] { return 20.0; })).by() == ReversalsBy::neither);
}

TEST_CASE("a valve whose moves up and down take different times still reverses by travel") {
  numeric::Random random(4);
  std::size_t move = 0;
  const auto slow_up = [&] {
    const double stretch = 0.6 + 0.8 * random.uniform();
    return (move++ % 2 == 0 ? 30.0 : 8.0) * stretch;
  };
  CHECK(find_reversals(zigzag(
                           40, [] { return 4.0; }, slow_up))
            .by() == ReversalsBy::travel);
}

// 1200 samples; PV follows CO slowly.
Prepared prepared(const Series& co, double low = 0.0, double high = 100.0) {
  Series pv;
  double y = co.front();
  for (const double u : co) pv.push_back(y += 0.2 * (u - y));
  return prepare({.period_s = 1.0, .pv = pv, .co = co, .co_low = low, .co_high = high});
}

TEST_CASE("CO between its limits is saturation, a stretch away from them is judged") {
  const Series clipped =
      made_of(1200, [](double k) { return std::clamp(50.0 + 90.0 * sine(k / 60.0), 0.0, 100.0); });
  CHECK(prepared(clipped).gate == Gate::saturation);
  // The log need not contain the limits.
  const Series inner =
      made_of(1200, [](double k) { return std::clamp(50.0 + 90.0 * sine(k / 60.0), 10.0, 90.0); });
  CHECK(prepared(inner).gate == Gate::saturation);
  const Series half = made_of(1200, [](double k) {
    return k < 500.0 ? std::clamp(50.0 + 60.0 * sine(k / 60.0), 0.0, 100.0)
                     : 50.0 + 10.0 * sine(k / 60.0);
  });
  const Prepared part = prepared(half);
  CHECK(part.gate == Gate::open);
  CHECK(part.from >= 460);
  CHECK(part.share_at_limit > 0.05);
}

TEST_CASE("coarse steps of CO, a smooth peak and a span that is not CO's own are no limits") {
  const Series smooth = made_of(1200, [](double k) { return 50.0 + 10.0 * sine(k / 300.0); });
  Series coarse = smooth;
  for (double& u : coarse) u = std::round(u);
  for (const Series& co : {smooth, coarse}) {
    const Prepared p = prepared(co);
    CHECK(p.gate == Gate::open);
    CHECK(p.used == co.size());
  }
  const Series scaled = made_of(1200, [](double k) { return sine(k / 60.0); });
  CHECK(prepared(scaled).used == scaled.size());
}

}  // namespace
}  // namespace loopwarden::tests::reversals_test
