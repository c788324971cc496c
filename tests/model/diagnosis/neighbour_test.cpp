// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "model/numeric/random.hpp"
#include "model/diagnosis/neighbour.hpp"

namespace loopwarden::tests::neighbour_test {
namespace {

using namespace loopwarden::diagnosis;
using diagnosis::Cause;
using diagnosis::DiagnosisVerdict;

struct Columns {
  std::vector<double> pv, co;
};

// A flow loop under PI at 1 s, all in %: first order, one or two samples of dead time, a load,
// noise, a sticking valve.
class FlowLoop {
 public:
  FlowLoop(double time_constant, double kp, double reset_time, double band, double jump,
           double load, std::size_t dead_time)
      : time_constant_(time_constant),
        kp_(kp),
        reset_time_(reset_time),
        band_(band),
        jump_(jump),
        load_intensity_(load),
        delayed_(dead_time, 50.0),
        valve_(50.0 + 0.4 * band) {}

  // He's model: the valve stays until CO is half the band plus the jump away. Then it moves all the
  // way except the friction's rest.
  void step(double push, numeric::Random& random) {
    if (band_ > 0.0) {
      const double away = co_ - valve_;
      if (std::abs(away) > 0.5 * (band_ + jump_))
        valve_ = co_ - std::copysign(0.5 * (band_ - jump_), away);
    } else {
      valve_ = co_;
    }
    delayed_.push_back(valve_);
    const double valve = delayed_.front();
    delayed_.erase(delayed_.begin());
    load_ = 0.98 * load_ + load_intensity_ * random.normal();
    flow_ += (valve + load_ + push - flow_) / time_constant_;
    const double pv = flow_ + 0.05 * random.normal();
    integral_ += kp_ * (50.0 - pv) / reset_time_;
    co_ = std::clamp(integral_ + kp_ * (50.0 - pv), 0.0, 100.0);
    columns.pv.push_back(pv);
    columns.co.push_back(co_);
  }
  double moved() const { return flow_ - 50.0; }

  Columns columns;

 private:
  double time_constant_, kp_, reset_time_, band_, jump_, load_intensity_;
  std::vector<double> delayed_;
  double valve_;  // off its proper position, so that the loop begins to cycle
  double flow_ = 50.0;
  double load_ = 0.0;
  double integral_ = 50.0;
  double co_ = 50.0;
};

enum class Sticks { none, first, second, both };

FlowLoop calm_loop(numeric::Random& random, bool sticks) {
  const double band = sticks ? random.uniform(3.0, 8.0) : 0.0;
  return {random.uniform(1.5, 4.0),
          0.3,
          random.uniform(3.0, 9.0),
          band,
          band * random.uniform(0.4, 1.0),
          0.02,
          1 + static_cast<std::size_t>(random.uniform(0.0, 2.0))};
}

struct Two {
  Columns first, second;
};

constexpr std::size_t kSettled = 200;

Two columns_of(FlowLoop& first, FlowLoop& second) {
  for (FlowLoop* loop : {&first, &second}) {
    loop->columns.pv.erase(loop->columns.pv.begin(), loop->columns.pv.begin() + kSettled);
    loop->columns.co.erase(loop->columns.co.begin(), loop->columns.co.begin() + kSettled);
  }
  return {first.columns, second.columns};
}

// Two loops on one header: if the flow of one rises, that of the other falls, by the same share
// either way.
Two on_header(Sticks sticks, double share, std::uint64_t seed, std::size_t samples = 3000) {
  numeric::Random random(seed);
  FlowLoop first = calm_loop(random, sticks == Sticks::first || sticks == Sticks::both);
  FlowLoop second = calm_loop(random, sticks == Sticks::second || sticks == Sticks::both);
  for (std::size_t k = 0; k < samples + kSettled; ++k) {
    const double by_first = -share * first.moved();
    first.step(-share * second.moved(), random);
    second.step(by_first, random);
  }
  return columns_of(first, second);
}

// The first is tuned so tightly that its load makes it swing. The second has it as its load, after
// a lag of some samples.
Two behind_tight(double share, std::uint64_t seed) {
  numeric::Random random(seed);
  const double time_constant = random.uniform(1.5, 3.0);
  FlowLoop first(time_constant, 0.25 * time_constant + 0.2, 3.0, 0.0, 0.0, 0.2, 2);
  FlowLoop second = calm_loop(random, false);
  const double lag = random.uniform(3.0, 8.0);
  double late = 0.0;
  for (std::size_t k = 0; k < 3000 + kSettled; ++k) {
    late += (share * first.moved() - late) / lag;
    first.step(0.0, random);
    second.step(late, random);
  }
  return columns_of(first, second);
}

// Two loops that one cause from elsewhere moves at the same moment.
Two with_one_load(std::uint64_t seed) {
  numeric::Random random(seed);
  FlowLoop first = calm_loop(random, false);
  FlowLoop second = calm_loop(random, false);
  double load = 0.0;
  for (std::size_t k = 0; k < 3000 + kSettled; ++k) {
    load = 0.95 * load + 0.3 * random.normal();
    first.step(load, random);
    second.step(load, random);
  }
  return columns_of(first, second);
}

LoopMoves moves(const Columns& columns) { return moves_of(columns.pv, columns.co); }

TEST_CASE("neighbours: a sticky source pushes a healthy loop on its header, never the other way",
          "[survey][neighbour]") {
  std::size_t found = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Two two = on_header(Sticks::first, 0.3, seed);
    const LoopMoves first = moves(two.first);
    const LoopMoves second = moves(two.second);
    found += push(first, true, second).has_value();
    INFO("seed " << seed);
    CHECK_FALSE(push(second, false, first));
  }
  CHECK(found >= 30);
}

TEST_CASE(
    "neighbours: a sticky loop is not pushed by a healthy one; two sticky ones push each other",
    "[survey][neighbour]") {
  // Only the second sticks, and no other loop pushes it.
  std::size_t wrong = 0;
  for (std::uint64_t seed = 101; seed <= 140; ++seed) {
    const Two two = on_header(Sticks::second, 0.3, seed);
    wrong += push(moves(two.first), false, moves(two.second)).has_value();
  }
  CHECK(wrong <= 1);
  // If both stick, each pushes the other.
  std::size_t there = 0;
  std::size_t back = 0;
  for (std::uint64_t seed = 201; seed <= 240; ++seed) {
    const Two two = on_header(Sticks::both, 0.3, seed);
    const LoopMoves first = moves(two.first);
    const LoopMoves second = moves(two.second);
    there += push(first, true, second).has_value();
    back += push(second, true, first).has_value();
  }
  CHECK(there >= 10);
  CHECK(back >= 10);
}

TEST_CASE("neighbours: a loop that swings first by its tuning pushes the one that swings after it",
          "[survey][neighbour]") {
  std::size_t found = 0;
  std::size_t wrong = 0;
  for (std::uint64_t seed = 301; seed <= 340; ++seed) {
    const Two two = behind_tight(0.5, seed);
    const LoopMoves first = moves(two.first);
    const LoopMoves second = moves(two.second);
    const auto pushed = push(first, false, second);
    found += pushed && !pushed->by_jumps;
    wrong += push(second, false, first).has_value();
  }
  CHECK(found >= 28);
  CHECK(wrong == 0);
}

TEST_CASE("neighbours: unrelated loops that look alike, or loops with one load",
          "[survey][neighbour]") {
  std::size_t alike = 0;
  std::size_t load = 0;
  for (std::uint64_t seed = 1000; seed < 1200; ++seed) {
    // In turn: both stick, one does, or both swing by their tuning.
    const Two two = seed % 2 == 0 ? on_header(Sticks::both, 0.0, seed) : behind_tight(0.0, seed);
    const LoopMoves first = moves(two.first);
    const LoopMoves second =
        seed % 4 == 1 ? moves(behind_tight(0.0, 5000 + seed).first) : moves(two.second);
    const bool sticks = seed % 2 == 0;
    alike += push(first, sticks, second) || push(second, sticks, first);
    if (seed >= 1050) continue;
    const Two common = with_one_load(seed);
    const LoopMoves one = moves(common.first);
    const LoopMoves other = moves(common.second);
    load += push(one, false, other) || push(other, false, one);
  }
  CAPTURE(alike, load);
  CHECK(alike < 10);  // of 200
  CHECK(load < 3);    // of 50
}

TEST_CASE("neighbours: missing samples, short and still records", "[survey][neighbour]") {
  Two two = on_header(Sticks::first, 0.4, 7);
  for (std::size_t k = 500; k < 700; ++k)
    two.first.pv[k] = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t k = 3; k < two.second.co.size(); k += 211)
    two.second.co[k] = std::numeric_limits<double>::quiet_NaN();
  CHECK(push(moves(two.first), true, moves(two.second)));
  two.first.pv.resize(300);
  two.first.co.resize(300);
  CHECK_FALSE(push(moves(two.first), true, moves(two.first)));
  const Columns still{std::vector<double>(3000, 50.0), std::vector<double>(3000, 40.0)};
  CHECK_FALSE(push(moves(still), true, moves(two.second)));
  CHECK_FALSE(push(moves(two.second), true, moves(still)));
  CHECK_FALSE(push(moves(still), true, moves(still)));
  CHECK(moves_of({}, {}).pv.empty());
}

TEST_CASE("neighbours: of many loops only pairs that move or swing alike are examined",
          "[survey][neighbour]") {
  std::vector<NeighbourLoop> all;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    all.push_back({summed_moves(moves(on_header(Sticks::both, 0.0, seed, 1500).first)), 0.0});
  }
  const Two two = on_header(Sticks::first, 0.8, 3, 1500);
  all.push_back({summed_moves(moves(two.first)), 0.0});
  all.push_back({summed_moves(moves(two.second)), 0.0});
  CHECK(pairs_to_look_at(all, 500).size() == 22 * 21 / 2);
  CHECK(pairs_to_look_at({}, 500).empty());
  const auto few = pairs_to_look_at(all, 3);
  CHECK(few.size() <= 3);
  CHECK(std::count(few.begin(), few.end(), std::pair<std::size_t, std::size_t>{20, 21}) == 1);
  all[4].period_s = 100.0;
  all[2].period_s = 103.0;
  all[9].period_s = 108.0;
  const auto like = pairs_to_look_at(all, 3);
  CHECK(std::count(like.begin(), like.end(), std::pair<std::size_t, std::size_t>{2, 4}) == 1);
  CHECK(std::count(like.begin(), like.end(), std::pair<std::size_t, std::size_t>{2, 9}) == 0);
}

TEST_CASE("neighbours: a neighbour never acquits", "[survey][neighbour]") {
  for (const bool main : {false, true}) {
    CHECK_FALSE(neighbour_is_cause(DiagnosisVerdict::valve_effect, Cause::stiction, main));
    CHECK_FALSE(neighbour_is_cause(DiagnosisVerdict::cant_tell, Cause::none, main));
    CHECK_FALSE(neighbour_is_cause(DiagnosisVerdict::not_enough_data, Cause::none, main));
    CHECK_FALSE(neighbour_is_cause(DiagnosisVerdict::other_cause, Cause::saturation, main));
    CHECK_FALSE(neighbour_is_cause(DiagnosisVerdict::other_cause, Cause::master_loop, main));
    CHECK(neighbour_is_cause(DiagnosisVerdict::other_cause, Cause::disturbance, main));
    CHECK(neighbour_is_cause(DiagnosisVerdict::other_cause, Cause::tuning, main) == main);
    CHECK(neighbour_is_cause(DiagnosisVerdict::healthy, Cause::none, main) == main);
  }
}

}  // namespace
}  // namespace loopwarden::tests::neighbour_test
