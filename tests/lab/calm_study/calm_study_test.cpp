// SPDX-License-Identifier: Apache-2.0
#include "lab/calm_study/calm_study.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "lab/calm_study/calm_commission.hpp"

namespace calm_study_test {

using namespace loopwarden;
using namespace loopwarden::lab;

namespace {

// Returns the RMS of SP - PV with planned moves over that without them, without any trouble.
double factor_without_trouble(StickyLoop loop) {
  loop.trial.unmeasured = 4;
  const double without = run_trial(loop.trial).settled.rms_error;
  numeric::Random random(1);
  for (const Contestant& one : contestants()) {
    if (one.name == "planned_moves") one.fit(loop, random, loop.trial);
  }
  return run_trial(loop.trial).settled.rms_error / without;
}

}  // namespace

TEST_CASE("spread of values", "[studies]") {
  std::vector<double> values;
  for (int i = 100; i >= 0; --i) values.push_back(i);
  const Spread s = spread_of(values);
  CHECK(s.tenth == 10.0);
  CHECK(s.median == 50.0);
  CHECK(s.ninetieth == 90.0);
  CHECK(s.worst == 100.0);
  CHECK(spread_of({3.0}).median == 3.0);
  CHECK(spread_of({}).worst == 0.0);
}

TEST_CASE("random sticky loops stay within the stated ranges and are repeatable",
          "[calm][studies]") {
  std::set<std::string> laws;
  for (std::size_t i = 0; i < 300; ++i) {
    const StickyLoop loop = random_sticky_loop(5, i, Load::steady);
    laws.insert(loop.law);
    const plant::LoopModel& m = loop.trial.model;
    CHECK((loop.s >= 0.1 && loop.s <= 1.5));
    CHECK((loop.j >= 0.1 * loop.s && loop.j <= loop.s));
    CHECK(m.valve_effects.front().parameters.at("s") == loop.s);
    CHECK((m.process.gain >= 0.5 && m.process.gain <= 2.0));
    const double dead_time_ratio = m.process.dead_time_s / m.process.time_constant_s;
    CHECK((dead_time_ratio >= 0.2 && dead_time_ratio <= 2.0));
    CHECK((m.transmitter.noise >= 0.0 && m.transmitter.noise <= 0.002 * m.transmitter.high));
    CHECK(m.disturbances.empty());
    for (const auto& [time_s, set_point] : m.scenario.set_point) {
      CHECK((set_point >= 0.2 * m.transmitter.high && set_point <= 0.8 * m.transmitter.high));
    }
  }
  CHECK(laws == std::set<std::string>{"choudhury", "he", "karnopp"});

  const StickyLoop once = random_sticky_loop(5, 7, Load::wandering);
  CHECK(once.trial.model.scenario.seed ==
        random_sticky_loop(5, 7, Load::wandering).trial.model.scenario.seed);
  CHECK(once.trial.model.disturbances.size() == 1);
  CHECK(random_sticky_loop(6, 7, Load::steady).trial.model.process != once.trial.model.process);
  CHECK(random_sticky_loop(5, 8, Load::steady).trial.model.process != once.trial.model.process);
}

TEST_CASE("the study does not depend on the number of threads", "[calm][studies]") {
  std::size_t reported = 0;
  const StudyWork many{.threads = 3, .progress = [&](std::size_t done, std::size_t total) {
                         CHECK(total == 3);
                         reported = std::max(reported, done);
                       }};
  const StickyStudy a =
      study_sticky_loops(3, 4, Load::steady, "planned_moves", {.threads = 1, .progress = {}});
  const StickyStudy b = study_sticky_loops(3, 4, Load::steady, "planned_moves", many);
  CHECK(reported == 3);
  REQUIRE(a.rows.size() == 5);
  REQUIRE(b.rows.size() == a.rows.size());
  for (std::size_t i = 0; i < a.rows.size(); ++i) {
    CHECK(a.rows[i].name == b.rows[i].name);
    CHECK(a.rows[i].factors == b.rows[i].factors);
    CHECK(a.rows[i].whole_rms_factor == b.rows[i].whole_rms_factor);
  }
}

TEST_CASE("each kind of trouble during planned moves is tried separately", "[calm][studies]") {
  constexpr std::uint64_t kSeed = 6004;
  constexpr std::size_t kLoops = 2;
  // Planned moves that have disengaged before the trouble would hide it.
  for (std::size_t i = 0; i < kLoops; ++i) {
    CAPTURE(i);
    CHECK(factor_without_trouble(random_sticky_loop(kSeed, i, Load::wandering)) < 0.7);
  }
  const std::vector<TroubleRow> rows =
      study_troubles(kLoops, kSeed, {.threads = 2, .progress = {}});
  REQUIRE(rows.size() == 8);
  CHECK(rows.front().kind == Trouble::Kind::read_back_stuck);
  CHECK(rows.back().kind == Trouble::Kind::repaired);
  std::set<double> factors;
  for (const TroubleRow& row : rows) {
    CAPTURE(to_text(row.kind));
    factors.insert(row.worst);
    CHECK((row.share_worse == 0.0 || row.worst > 1.3));
    CHECK(row.worst < 1.6);
  }
  CHECK(factors.size() == rows.size());  // each kind gives a different result
  const std::vector<TroubleRow> alone = study_troubles(1, kSeed, {});
  for (std::size_t k = 0; k < rows.size(); ++k) CHECK(alone[k].worst <= rows[k].worst);
  CHECK(study_troubles(0, kSeed, {}).empty());
}

TEST_CASE("every contestant switches one compensator on", "[calm][studies]") {
  const StickyLoop loop = random_sticky_loop(5, 1, Load::steady);
  for (const Contestant& one : contestants()) {
    if (one.costly) continue;
    CAPTURE(one.name);
    numeric::Random random(1);
    CalmTrial trial = loop.trial;
    one.fit(loop, random, trial);
    const control::ControllerSettings& c = trial.model.controller;
    CHECK((c.jacket.form != control::JacketForm::off) !=
          (c.compensator.kind != control::CompensatorKind::none));
    CHECK(trial.model.process == loop.trial.model.process);
  }
}

TEST_CASE("the project identifies process, s and j of a loop that it watches",
          "[calm][studies][long]") {
  StickyLoop loop = random_sticky_loop(5, 3, Load::steady);
  loop.s = 0.8;
  loop.j = 0.4;
  loop.trial.model.valve_effects.front().parameters = {{"s", 0.8}, {"j", 0.4}};
  numeric::Random random(1);
  const auto found = found_out(loop, random);
  REQUIRE(found);
  CHECK(found->s == Approx(0.8).epsilon(0.2));
  CHECK(found->j == Approx(0.4).epsilon(0.3));
  CHECK(found->gain == Approx(loop.trial.model.process.gain).epsilon(0.1));
}

}  // namespace calm_study_test
