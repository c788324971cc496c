// SPDX-License-Identifier: Apache-2.0
#include "model/control/planned_moves.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "model/control/planned_moves_limits.hpp"
#include "model/control/simulated_controller.hpp"
#include "model/numeric/random.hpp"
#include "model/plant/plant.hpp"

namespace planned_moves_test {

using namespace loopwarden;
using namespace loopwarden::control;

namespace {

constexpr double kS = 0.6;  // CO units
constexpr double kJ = 0.3;  // CO units

plant::LoopModel loop(const std::string& law, double load = 0.0) {
  plant::LoopModel m;
  m.sample_time_s = 0.1;
  m.controller.pid = {.gains = {.kp = 0.25, .ki = 0.06}, .output_high = 10.0};
  m.controller.output.high = 10.0;
  m.controller.set_point.high = 15.0;
  m.process = {.gain = 1.5, .time_constant_s = 4.0, .dead_time_s = 2.0};
  m.transmitter = {.high = 15.0, .noise = 0.01};
  if (law != "none") {
    m.valve_effects = {
        {.name = "stiction", .parameters = {{"s", kS}, {"j", kJ}}, .options = {{"law", law}}}};
  }
  if (load > 0.0) {
    m.disturbances = {
        {.name = "random_load", .parameters = {{"intensity", load}, {"time_constant", 300.0}}}};
  }
  m.scenario.set_point = {{0.0, 7.0}, {10.0, 8.0}};
  m.scenario.seed = 3;
  return m;
}

CompensatorSettings moves(double load = 0.0) {
  return {
      .kind = CompensatorKind::planned_moves,
      .planned = {
          .gain = 1.5, .time_constant_s = 4.0, .dead_time_s = 2.0, .load = load, .s = kS, .j = kJ}};
}

struct ReadBack {
  double position = 0.0;
  bool valid = true;
};

struct Run {
  std::vector<double> error, co, pv;  // SP - true PV
  std::vector<MovePhase> phase;
  MovesState state;

  double rms(std::size_t from) const {
    double squares = 0.0;
    for (std::size_t k = from; k < error.size(); ++k) squares += error[k] * error[k];
    return std::sqrt(squares / static_cast<double>(error.size() - from));
  }
  bool was(MovePhase wanted) const {
    return std::find(phase.begin(), phase.end(), wanted) != phase.end();
  }
  std::size_t first(MovePhase wanted) const {
    return static_cast<std::size_t>(std::find(phase.begin(), phase.end(), wanted) - phase.begin());
  }
};

// Runs a loop period by period.
struct Bench {
  explicit Bench(const plant::LoopModel& m)
      : plant(m, m.scenario.seed),
        controller(m.controller, m.sample_time_s, m.scenario.set_point.front().second, 0.0) {
    co = plant.output_for(m.scenario.set_point.front().second);
    plant.reset(co);
    controller.assume_output(co);
    controller.request_mode(Mode::automatic);
  }
  ControllerOutput step(ReadBack read) {
    const ControllerOutput out = controller.step({.process_variable = plant.process_variable(),
                                                  .read_back = read.position,
                                                  .read_back_valid = read.valid});
    co = out.output;
    plant.step(to_valve ? to_valve(co) : co);
    return out;
  }
  ControllerOutput step() { return step({plant.stem()}); }
  void steps(int count) {
    for (int k = 0; k < count; ++k) step();
  }
  bool until(MovePhase phase, int most) {
    for (int k = 0; k < most && state().phase != phase; ++k) step();
    return state().phase == phase;
  }
  MovesState state() const { return controller.moves().value_or(MovesState{}); }

  plant::Plant plant;
  SimulatedController controller;
  double co = 0.0;
  std::function<double(double)> to_valve;  // the valve's response to CO at the stem
};

// `read_back` maps the stem to its read-back. `set_point` replaces the scenario's.
Run run(const plant::LoopModel& m, double duration_s,
        const std::function<ReadBack(double time_s, double stem)>& read_back = {},
        const std::function<double(double time_s)>& set_point = {}) {
  Bench bench(m);
  SimulatedController& c = bench.controller;
  Run result;
  const auto samples = static_cast<std::size_t>(duration_s / m.sample_time_s);
  for (std::size_t k = 0; k < samples; ++k) {
    const double time_s = static_cast<double>(k) * m.sample_time_s;
    for (const auto& [from_s, wanted] : m.scenario.set_point) {
      if (time_s >= from_s) c.request_set_point(wanted);
    }
    if (set_point) c.request_set_point(set_point(time_s));
    const double stem = bench.plant.stem();
    const double true_pv = bench.plant.true_process_variable();
    const ControllerOutput out = bench.step(read_back ? read_back(time_s, stem) : ReadBack{stem});
    result.error.push_back(out.set_point - true_pv);
    result.pv.push_back(true_pv);
    result.co.push_back(out.output);
    if (const std::optional<MovesState> now = c.moves()) {
      result.state = *now;
      result.phase.push_back(now->phase);
    }
  }
  return result;
}

}  // namespace

TEST_CASE("planned moves stop the cycle of a sticking valve, with and without read-back",
          "[control][planned_moves]") {
  const std::string law = GENERATE("choudhury", "he", "karnopp");
  const double load = GENERATE(0.0, 0.008);
  const bool read_back = GENERATE(true, false);
  CAPTURE(law, load, read_back);
  plant::LoopModel m = loop(law, load);
  const Run without = run(m, 4000.0);
  m.controller.compensator = moves(load);
  m.controller.compensator.planned.read_back = read_back;
  const Run with = run(m, 4000.0);
  REQUIRE(with.was(MovePhase::resting));
  CHECK(with.state.reason == DisengageReason::none);
  CHECK(with.rms(20000) < (load > 0.0 ? 0.7 : 0.3) * without.rms(20000));
  CHECK(with.state.gain < 1.0);
}

TEST_CASE("s and j that are off by 30 % are learnt from the read-back",
          "[control][planned_moves]") {
  const double factor = GENERATE(0.75, 1.3);
  plant::LoopModel m = loop("choudhury");
  const Run without = run(m, 4000.0);
  m.controller.compensator = moves();
  m.controller.compensator.planned.s *= factor;
  m.controller.compensator.planned.j *= factor;
  const Run with = run(m, 4000.0);
  CHECK(with.rms(20000) < 0.3 * without.rms(20000));
  CHECK(with.state.s == Approx(kS).epsilon(0.1));
  CHECK(with.state.j == Approx(kJ).epsilon(0.15));
}

TEST_CASE("a healthy valve follows the probe, and the moves disengage for good",
          "[control][planned_moves]") {
  plant::LoopModel m = loop("none");
  m.valve_effects = {{.name = "positioner_lag", .parameters = {{"time_constant", 1.5}}}};
  m.disturbances = {
      {.name = "oscillating_disturbance", .parameters = {{"amplitude", 0.3}, {"period", 60.0}}}};
  const Run without = run(m, 3000.0);
  m.controller.compensator = moves();
  const Run with = run(m, 3000.0);
  REQUIRE(with.was(MovePhase::probing));
  CHECK_FALSE(with.was(MovePhase::moving));
  CHECK(with.state.phase == MovePhase::disengaged);
  CHECK(with.state.reason == DisengageReason::valve_follows);
  CHECK(with.rms(0) < 1.02 * without.rms(0));
}

TEST_CASE("a loop that does not cycle is left alone", "[control][planned_moves]") {
  plant::LoopModel m = loop("none");
  const Run without = run(m, 1000.0);
  m.controller.compensator = moves();
  const Run with = run(m, 1000.0);
  CHECK(with.state.phase == MovePhase::watching);
  CHECK(with.co == without.co);
}

TEST_CASE("CO is held while the read-back is lost in a move", "[control][planned_moves]") {
  plant::LoopModel m = loop("karnopp", 0.012);
  m.controller.compensator = moves(0.012);
  const Run whole = run(m, 4000.0);
  const std::size_t move = whole.first(MovePhase::moving);
  REQUIRE(move < whole.co.size());
  const double move_s = static_cast<double>(move) * m.sample_time_s;
  // A stem that seems to stick is pushed further.
  const auto stands = [&](double lost_s) {
    return [&, lost_s, place = 0.0](double time_s, double stem) mutable {
      if (time_s <= move_s) place = stem;
      return ReadBack{place, time_s < lost_s};
    };
  };
  const Run pushed = run(m, 4000.0, stands(4000.0));
  std::size_t push = move + 2;
  while (push < pushed.co.size() && pushed.co[push] == pushed.co[push - 1]) ++push;
  REQUIRE(push + 20 < pushed.co.size());
  REQUIRE(pushed.phase[push + 5] == MovePhase::moving);
  const Run lost = run(m, 4000.0, stands(static_cast<double>(push + 2) * m.sample_time_s));
  CHECK(pushed.co[push + 5] != pushed.co[push + 3]);
  CHECK(lost.co[push + 5] == lost.co[push + 3]);
}

TEST_CASE("after the loss of the read-back the moves disengage without a bump",
          "[control][planned_moves]") {
  plant::LoopModel m = loop("choudhury");
  m.controller.compensator = moves();
  const Run with = run(m, 3000.0, [](double time_s, double stem) {
    return ReadBack{stem, time_s < 2500.0};
  });
  CHECK(with.state.phase == MovePhase::disengaged);
  CHECK(with.state.reason == DisengageReason::read_back_lost);
  const std::size_t given = with.first(MovePhase::disengaged);
  REQUIRE(given >= 25000);
  REQUIRE(given < with.co.size());
  // Only the law's own response to noise.
  CHECK(std::abs(with.co[given] - with.co[given - 1]) < 0.05);
}

TEST_CASE("a read-back that froze or moved by itself is not trusted", "[control][planned_moves]") {
  const bool frozen = GENERATE(true, false);
  plant::LoopModel m = loop("choudhury", 0.01);
  m.controller.compensator = moves(0.01);
  double last = 0.0;
  const Run with = run(m, 6000.0, [&](double time_s, double stem) {
    if (!frozen) return ReadBack{time_s < 3000.0 ? stem : stem + 1.0};
    if (time_s < 3000.0) last = stem;
    return ReadBack{last};
  });
  REQUIRE(with.phase[29999] != MovePhase::disengaged);
  CHECK(std::find(with.phase.begin() + 30000, with.phase.end(), MovePhase::disengaged) !=
        with.phase.end());
}

TEST_CASE("a repaired valve disengages the moves", "[control][planned_moves]") {
  plant::LoopModel m = loop("choudhury", 0.01);
  m.scenario.faults = {{.effect = m.valve_effects.front(), .schedule = {.to_s = 3000.0}}};
  m.valve_effects.clear();
  m.controller.compensator = moves(0.01);
  const Run with = run(m, 8000.0);
  REQUIRE(with.phase[29999] != MovePhase::disengaged);
  CHECK(with.state.phase == MovePhase::disengaged);
  CHECK(with.state.reason == DisengageReason::valve_follows);
}

TEST_CASE("a valve that is repaired while CO is held is probed, and the moves disengage",
          "[control][planned_moves]") {
  plant::LoopModel m = loop("choudhury");
  m.valve_effects.front().parameters.at("j") = 0.98 * kS;  // CO is held when friction ends
  m.scenario.faults = {{.effect = m.valve_effects.front(), .schedule = {.to_s = 3000.0}}};
  m.valve_effects.clear();
  m.controller.compensator = moves();
  m.controller.compensator.planned.j = 0.98 * kS;
  const Run with = run(m, 8000.0);
  REQUIRE(with.phase[29999] == MovePhase::resting);
  CHECK(with.state.phase == MovePhase::disengaged);
  CHECK(with.state.reason == DisengageReason::valve_follows);
}

TEST_CASE("a late read-back disengages the moves for good after one move",
          "[control][planned_moves]") {
  plant::LoopModel m = loop("karnopp", 0.01);
  m.controller.compensator = moves(0.01);
  std::vector<double> stems;
  const Run with = run(m, 8000.0, [&](double time_s, double stem) {
    stems.push_back(stem);
    return ReadBack{time_s < 4000.0 ? stem : stems[stems.size() - 51]};  // 5 s
  });
  REQUIRE(with.phase[39999] != MovePhase::disengaged);
  CHECK(with.state.phase == MovePhase::disengaged);
  CHECK(with.state.reason == DisengageReason::moved_late);
  CHECK(with.state.latched);
}

TEST_CASE("on an integrating process the moves disengage", "[control][planned_moves]") {
  plant::LoopModel m = loop("choudhury");
  m.process = {.gain = 0.1, .dead_time_s = 2.0, .kind = plant::ProcessKind::integrating};
  m.controller.pid.gains = {.kp = 1.5, .ki = 0.05};
  const Run without = run(m, 8000.0);
  m.controller.compensator = moves();
  m.controller.compensator.planned.gain = 2.0;  // like a lag of 20 s
  m.controller.compensator.planned.time_constant_s = 20.0;
  const Run with = run(m, 8000.0);
  REQUIRE(with.was(MovePhase::probing));
  CHECK(with.state.phase == MovePhase::disengaged);
  CHECK(with.state.latched);
  CHECK(with.rms(40000) < 1.3 * without.rms(40000));
}

TEST_CASE("CO stays within the output's limits, and a set point out of reach is no fault",
          "[control][planned_moves]") {
  plant::LoopModel m = loop("choudhury", 0.01);
  m.controller.output.low = 4.0;
  m.controller.output.high = 7.0;
  m.controller.compensator = moves(0.01);
  const Run with = run(m, 6000.0, {}, [](double time_s) {
    return time_s < 3000.0 ? 8.0 : time_s < 4500.0 ? 14.0 : 9.0;
  });
  REQUIRE(with.was(MovePhase::moving));
  for (const double co : with.co) REQUIRE((co >= 4.0 && co <= 7.0));
  CHECK(std::abs(with.error.back()) < 0.5);
}

TEST_CASE("no move is longer and no hour has more than allowed", "[control][planned_moves]") {
  struct Limit {
    double allowed;
    double hours;
    std::size_t most;
    double set_point_stands_s;
    double load;
  };
  const Limit limit = GENERATE(Limit{12.0, 1.0, 12, 1e6, 0.02}, Limit{1.5, 1.0, 1, 1700.0, 0.002},
                               Limit{0.5, 2.0, 1, 3000.0, 0.002});
  plant::LoopModel m = loop("he", limit.load);
  m.controller.compensator = moves(limit.load);
  m.controller.compensator.planned.max_moves_per_hour = limit.allowed;
  m.controller.compensator.planned.max_move = 2.5 * kJ;
  const Run with = run(m, 4.0 * 3600.0 + 1500.0, {}, [&](double time_s) {
    return std::fmod(time_s, 2.0 * limit.set_point_stands_s) < limit.set_point_stands_s ? 8.0 : 7.0;
  });
  REQUIRE(with.was(MovePhase::moving));
  // A detour consists of a move away and a move back.
  std::vector<double> made_s;
  for (std::size_t k = 1; k < with.phase.size(); ++k) {
    const MovePhase phase = with.phase[k];
    if (phase == with.phase[k - 1]) continue;
    if (phase != MovePhase::backing_off && phase != MovePhase::moving) continue;
    made_s.push_back(0.1 * static_cast<double>(k));
    const auto newest =
        static_cast<std::size_t>(std::count_if(made_s.begin(), made_s.end(), [&](double t) {
          return t > made_s.back() - 3600.0 * limit.hours;
        }));
    REQUIRE(newest <= limit.most);
  }
  const std::size_t from = with.first(MovePhase::resting);
  for (std::size_t k = from + 1; k < with.co.size(); ++k) {
    if (with.phase[k] == MovePhase::disengaged) break;
    REQUIRE(std::abs(with.co[k] - with.co[k - 1]) < 0.5 + 2.0 * kS);
  }
}

TEST_CASE("a move that is longer than allowed is not made in another way",
          "[control][planned_moves]") {
  plant::LoopModel m = loop("he", 0.02);
  m.controller.compensator = moves(0.02);
  m.controller.compensator.planned.max_move = kJ;  // even a detour is longer
  const Run with = run(m, 4000.0);
  CHECK_FALSE(with.was(MovePhase::backing_off));
}

TEST_CASE("a shadow leaves the output unchanged and reports its expected gain",
          "[control][planned_moves]") {
  plant::LoopModel m = loop("karnopp");
  const Run without = run(m, 4000.0);
  m.controller.compensator = moves();
  m.controller.compensator.shadow = true;
  const Run with = run(m, 4000.0);
  CHECK(with.co == without.co);
  CHECK(with.state.phase == MovePhase::resting);
  CHECK(with.state.gain > 0.0);
  CHECK(with.state.gain < 0.5);
}

TEST_CASE("the gain that a shadow reports is the gain that acting achieves",
          "[control][planned_moves]") {
  plant::LoopModel m = loop("karnopp", 0.01);
  m.controller.compensator = moves(0.01);
  const Run acting = run(m, 8000.0);
  REQUIRE(acting.state.reason == DisengageReason::none);
  m.controller.compensator.shadow = true;
  const Run shadow = run(m, 8000.0);
  CHECK(shadow.state.gain == Approx(acting.state.gain).margin(0.1));
  // The travel of the real stem does not count for the shadow.
  CHECK(static_cast<double>(shadow.state.moves) > 0.7 * acting.state.moves);
}

TEST_CASE("planned moves that act after a shadow keep what they have learnt",
          "[control][planned_moves]") {
  plant::LoopModel m = loop("choudhury");
  m.controller.compensator = moves();
  m.controller.compensator.shadow = true;
  m.controller.compensator.planned.s *= 1.2;
  Bench bench(m);
  bench.controller.request_set_point(8.0);
  bench.steps(30000);
  REQUIRE(bench.state().gain > 0.0);
  REQUIRE(bench.state().moves > 0);
  const double learnt = bench.state().s;
  CHECK(learnt == Approx(kS).epsilon(0.1));

  m.controller.compensator.shadow = false;
  bench.controller.configure(m.controller);
  const double before = bench.co;
  bench.steps(2);
  CHECK(bench.co == Approx(before).margin(0.02));
  CHECK(bench.state().phase == MovePhase::probing);
  CHECK(bench.state().moves == 0);
  CHECK_FALSE(bench.state().shadow);
  CHECK(bench.state().s == Approx(learnt));
  // Other settings restart the learning.
  m.controller.compensator.planned.load = 0.01;
  bench.controller.configure(m.controller);
  bench.step();
  CHECK(bench.state().phase == MovePhase::watching);
}

TEST_CASE("no hour has more moves than allowed over a time in shadow, or a reload",
          "[control][planned_moves]") {
  const bool shadow = GENERATE(true, false);
  CAPTURE(shadow);
  plant::LoopModel m = loop("choudhury");
  m.controller.compensator = moves();
  m.controller.compensator.planned.max_moves_per_hour = 2.0;
  Bench bench(m);
  std::vector<int> made;  // periods
  MovePhase before = MovePhase::watching;
  int period = 0;
  const auto go_on_until = [&](int end) {
    for (; period < end; ++period) {
      bench.step();
      const MovesState now = bench.state();
      const bool leg = now.phase == MovePhase::moving || now.phase == MovePhase::backing_off;
      if (!now.shadow && leg && now.phase != before) made.push_back(period);
      before = now.phase;
    }
  };
  while (made.size() < 2 && period < 20000) {
    bench.controller.request_set_point(period / 1000 % 2 == 0 ? 8.0 : 7.0);
    go_on_until(period + 1);
  }
  REQUIRE(made.size() == 2);
  REQUIRE(made.back() - made.front() < 3000);
  bench.controller.request_set_point(8.0);
  if (shadow) {
    go_on_until(made.front() + 10000);
    m.controller.compensator.shadow = true;
    bench.controller.configure(m.controller);
    bench.controller.request_set_point(7.5);  // at which it cycles
    go_on_until(made.front() + 32000);
    REQUIRE(bench.state().shadow);
    m.controller.compensator.shadow = false;
  } else {
    go_on_until(made.front() + 28000);
    m.controller.compensator.planned.load = 0.001;
  }
  bench.controller.configure(m.controller);
  const auto step_until = [&](int end) {
    while (made.size() == 2 && period < end) {
      bench.controller.request_set_point(period / 1000 % 2 == 0 ? 8.0 : 7.0);
      go_on_until(period + 1);
    }
  };
  const int hour = made.front() + 35900;
  step_until(hour);
  CHECK(period == hour);
  step_until(hour + 20000);
  CHECK(made.size() > 2);
}

TEST_CASE("a set point that steps just after a move did not move the stem is followed at once",
          "[control][planned_moves]") {
  plant::LoopModel m = loop("choudhury");
  m.controller.compensator = moves();
  Bench bench(m);
  bench.controller.request_set_point(8.0);
  bench.steps(30000);
  REQUIRE(bench.state().phase == MovePhase::resting);
  // From here on the stem breaks loose only after a large change of CO.
  bench.to_valve = [held = bench.co](double co) mutable {
    if (std::abs(co - held) > 2.0) held = co;
    return held;
  };
  const double stem = bench.plant.stem();
  bench.controller.request_set_point(8.8);
  REQUIRE(bench.until(MovePhase::moving, 50));
  REQUIRE(bench.until(MovePhase::resting, 600));
  REQUIRE(bench.plant.stem() == Approx(stem).margin(1e-3));
  bench.steps(20);
  const double before = bench.co;
  bench.controller.request_set_point(12.0);
  bench.steps(10);
  CHECK(bench.co > before + 1.0);
  bench.steps(300);
  CHECK(bench.plant.true_process_variable() == Approx(12.0).margin(0.3));
  CHECK(bench.state().reason == DisengageReason::none);
}

TEST_CASE("a set point that steps just after the stem slipped by itself is followed at once",
          "[control][planned_moves]") {
  plant::LoopModel m = loop("choudhury");
  m.controller.compensator = moves();
  Bench bench(m);
  bench.controller.request_set_point(8.0);
  bench.steps(30000);
  REQUIRE(bench.state().phase == MovePhase::resting);
  const double stem = bench.plant.stem();
  const double push = bench.co > stem ? 0.5 : -0.5;
  bench.to_valve = [push](double co) { return co + push; };
  bench.steps(3);
  bench.to_valve = nullptr;
  bench.steps(30);
  REQUIRE(std::abs(bench.plant.stem() - stem) > 0.2);
  REQUIRE(bench.state().phase == MovePhase::resting);
  const double before = bench.co;
  bench.controller.request_set_point(10.0);
  bench.steps(10);
  CHECK(bench.co > before + 0.5);
  // The check whether the valve still sticks is made nevertheless.
  CHECK(bench.until(MovePhase::probing, 600));
  CHECK(bench.until(MovePhase::resting, 600));
  CHECK(bench.plant.true_process_variable() == Approx(10.0).margin(0.3));
}

TEST_CASE("with a rate limit of the output the loop is no worse than under PI only",
          "[control][planned_moves]") {
  const double percent_per_s = GENERATE(0.2, 0.5, 1.0, 5.0);
  const double s = GENERATE(0.3, 0.6);
  const std::string law = GENERATE("choudhury", "he");
  CAPTURE(percent_per_s, s, law);
  plant::LoopModel m = loop(law);
  m.valve_effects.front().parameters = {{"s", s}, {"j", 0.5 * s}};
  m.controller.output.rate_per_s = 0.1 * percent_per_s;
  const Run without = run(m, 5000.0);
  m.controller.compensator = moves();
  PlannedMovesSettings& told = m.controller.compensator.planned;
  told.s = s;
  told.j = 0.5 * s;
  told.max_move = 1.0;
  told.max_moves_per_hour = 60.0;
  const Run with = run(m, 5000.0);
  CHECK(with.rms(600) <= 1.1 * without.rms(600));
}

TEST_CASE("a stroke waits until CO has arrived", "[control][planned_moves]") {
  plant::LoopModel m = loop("choudhury", 0.006);
  m.controller.output.rate_per_s = 0.05;
  m.controller.compensator = moves(0.006);
  Bench bench(m);
  bench.controller.request_set_point(8.0);
  int legs = 0;
  for (int k = 0; k < 60000; ++k) {
    const MovesState before = bench.state();
    bench.step();
    if (before.phase != MovePhase::moving || bench.state().phase != MovePhase::resting) continue;
    ++legs;
    CHECK(bench.co == Approx(before.output).margin(1e-9));
  }
  CHECK(legs > 0);
}

TEST_CASE("a shadow with a rate limit reports the gain that acting achieves with it",
          "[control][planned_moves]") {
  plant::LoopModel m = loop("choudhury", 0.006);
  m.controller.output.rate_per_s = GENERATE(0.05, 0.1);
  m.controller.compensator = moves(0.006);
  const Run acting = run(m, 8000.0);
  m.controller.compensator.shadow = true;
  const Run shadow = run(m, 8000.0);
  REQUIRE(acting.was(MovePhase::moving));
  REQUIRE(shadow.was(MovePhase::moving));
  CHECK(acting.state.gain < shadow.state.gain + 0.15);
  CHECK(shadow.state.gain < 1.0);
}

TEST_CASE("a read-back that is renewed every few seconds makes the loop no worse than PI only",
          "[control][planned_moves]") {
  const double least_s = GENERATE(2.0, 3.0);
  const double most_s = GENERATE(3.0, 3.5);
  const double noise = GENERATE(0.0, 0.003);
  CAPTURE(least_s, most_s, noise);
  plant::LoopModel m = loop("choudhury");
  const Run without = run(m, 4000.0);
  m.controller.compensator = moves();
  m.controller.compensator.planned.max_move = 1.0;
  m.controller.compensator.planned.max_moves_per_hour = 60.0;
  numeric::Random random(7);
  double next_s = 0.0;
  double held = 0.0;
  const Run with = run(m, 4000.0, [&](double time_s, double stem) {
    if (time_s >= next_s) {
      held = stem + noise * random.normal();
      next_s = time_s + random.uniform(least_s, most_s);
    }
    return ReadBack{held};
  });
  CHECK(with.rms(600) <= 1.1 * without.rms(600));
}

TEST_CASE("limits that are narrower than the stick band let no move begin",
          "[control][planned_moves]") {
  plant::LoopModel m = loop("choudhury", 0.01);
  m.controller.output.low = 5.2;
  m.controller.output.high = 5.3;  // s - j is 0.3
  m.controller.compensator = moves(0.01);
  m.controller.compensator.shadow = GENERATE(false, true);
  const Run with =
      run(m, 4000.0, {}, [](double time_s) { return 7.9 + 0.3 * std::sin(0.05 * time_s); });
  CHECK_FALSE(with.was(MovePhase::moving));
  for (const double co : with.co) REQUIRE((co >= 5.2 && co <= 5.3));
}

TEST_CASE("the cycles that are still to be watched are shown", "[control][planned_moves]") {
  plant::LoopModel m = loop("choudhury");
  m.controller.compensator = moves();
  Bench bench(m);
  bench.controller.request_set_point(8.0);
  int most = 0;
  for (int k = 0; k < 30000 && bench.state().phase == MovePhase::watching; ++k) {
    const int cycles = bench.state().cycles_watched;
    CHECK(cycles >= most);
    most = std::max(most, cycles);
    bench.step();
  }
  CHECK(most >= PlannedMovesLimits::kLeastCyclesWatched);
  CHECK(most <= PlannedMovesLimits::kMostCyclesWatched);
}

TEST_CASE("units and direction of action change only the numbers of the answer",
          "[control][planned_moves]") {
  plant::LoopModel m = loop("he", 0.01);
  m.transmitter.noise = 0.0;
  m.controller.compensator = moves(0.01);
  const Run plain = run(m, 3000.0);

  // CO in percent, PV in thousandths.
  plant::LoopModel scaled = m;
  const double co = 10.0, pv = 1000.0;
  scaled.controller.pid.gains = {.kp = 0.25 * co / pv, .ki = 0.06 * co / pv};
  scaled.controller.pid.output_high = scaled.controller.output.high = 100.0;
  scaled.controller.set_point.high = scaled.transmitter.high = 15000.0;
  scaled.process.gain *= pv / co;
  for (auto& [name, value] : scaled.valve_effects.front().parameters) value *= co;
  scaled.disturbances.front().parameters.at("intensity") *= pv;
  for (auto& [time_s, set_point] : scaled.scenario.set_point) set_point *= pv;
  PlannedMovesSettings& told = scaled.controller.compensator.planned;
  told.gain *= pv / co;
  told.load *= pv;
  told.s *= co;
  told.j *= co;
  const Run other = run(scaled, 3000.0);
  CHECK(other.state.moves == plain.state.moves);
  CHECK(other.rms(0) == Approx(pv * plain.rms(0)).epsilon(2e-3));

  plant::LoopModel direct = m;
  direct.controller.pid.action = Action::direct;
  direct.process.gain = -1.5;
  direct.controller.pid.output_low = direct.controller.output.low = -10.0;
  direct.controller.compensator.planned.gain = -1.5;
  const Run mirrored = run(direct, 3000.0);
  CHECK(mirrored.rms(20000) == Approx(plain.rms(20000)).epsilon(0.1));
}

TEST_CASE("the cycle also stops at another sample time", "[control][planned_moves]") {
  const double period_s = GENERATE(0.05, 0.3);
  plant::LoopModel m = loop("karnopp");
  m.sample_time_s = period_s;
  const auto from = static_cast<std::size_t>(2000.0 / period_s);
  const Run without = run(m, 4000.0);
  m.controller.compensator = moves();
  CHECK(run(m, 4000.0).rms(from) < 0.5 * without.rms(from));
}

}  // namespace planned_moves_test
