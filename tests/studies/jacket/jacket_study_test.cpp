// SPDX-License-Identifier: Apache-2.0
#include "studies/jacket/jacket_study.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstddef>
#include <set>
#include <string>
#include <vector>

namespace jacket_study_test {

using namespace loopwarden;
using namespace loopwarden::studies;
using control::JacketForm;

namespace {

Plant1Row row(JacketForm form, double pv_swing, double co_swing, double turns, double rms,
              bool parked = false) {
  Plant1Row r;
  r.form = form;
  r.result.pv_swing = pv_swing;
  r.result.co_swing = co_swing;
  r.result.settled.reversals_per_hour = turns;
  r.result.settled.rms_error = rms;
  r.result.parked = parked;
  return r;
}

double parameter(const JacketTrial& trial, const char* name) {
  return trial.model.valve_effects.front().parameters.at(name);
}

}  // namespace

TEST_CASE("claims are counted against the loop without jacket before them", "[jacket][studies]") {
  const std::vector<Plant1Row> rows{
      row(JacketForm::off, 1.0, 1.0, 10.0, 0.5),
      row(JacketForm::paper, 0.9, 0.9, 11.0, 0.4),       // all three, RMS falls
      row(JacketForm::paper, 0.96, 0.96, 10.4, 0.48),    // less than 5 %
      row(JacketForm::paper, 0.0, 0.0, 0.0, 0.4, true),  // parked, yet RMS falls
      row(JacketForm::dwell, 0.5, 0.5, 5.0, 0.4),
      row(JacketForm::off, 0.5, 0.5, 20.0, 0.2),
      row(JacketForm::paper, 0.45, 0.6, 30.0, 0.4),  // smaller and faster
      row(JacketForm::paper, 0.1, 0.1, 0.0, 0.1),    // rests without being parked
  };
  const ClaimCount paper = count_claims(rows, JacketForm::paper);
  CHECK(paper.settings == 5);
  CHECK(paper.parked == 1);
  CHECK(paper.cycling == 3);
  CHECK(paper.smaller == 2);
  CHECK(paper.narrower == 1);
  CHECK(paper.faster == 2);
  CHECK(paper.all_three == 1);
  CHECK(paper.rms_falls == 3);
  const ClaimCount dwell = count_claims(rows, JacketForm::dwell);
  CHECK(dwell.settings == 1);
  CHECK(dwell.faster == 0);
  CHECK(count_claims(rows, JacketForm::bounded).settings == 0);
}

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
          "[jacket][studies]") {
  std::set<std::string> laws;
  for (std::size_t i = 0; i < 300; ++i) {
    const RandomLoop loop = random_sticky_loop(5, i, Load::steady);
    laws.insert(loop.law);
    const plant::LoopModel& m = loop.reported.model;
    const double s = parameter(loop.reported, "s");
    const double j = parameter(loop.reported, "j");
    CHECK((s >= 0.1 && s <= 1.5));
    CHECK((j >= 0.1 * s && j <= s));
    CHECK((m.process.gain >= 0.5 && m.process.gain <= 2.0));
    const double dead_time_ratio = m.process.dead_time_s / m.process.time_constant_s;
    CHECK((dead_time_ratio >= 0.2 && dead_time_ratio <= 2.0));
    CHECK((m.transmitter.noise >= 0.0 && m.transmitter.noise <= 0.002 * m.transmitter.high));
    CHECK(m.disturbances.empty());
    CHECK(m.scenario.set_point.size() == 6);
    for (const auto& [time_s, set_point] : m.scenario.set_point) {
      CHECK((set_point >= 0.2 * m.transmitter.high && set_point <= 0.8 * m.transmitter.high));
    }
    // The run on which Ks is chosen is another one of the same loop.
    CHECK(loop.chosen.model.process == m.process);
    CHECK(loop.chosen.model.valve_effects == m.valve_effects);
    CHECK(loop.chosen.model.scenario.seed != m.scenario.seed);
    CHECK(loop.chosen.model.scenario.set_point != m.scenario.set_point);
  }
  CHECK(laws == std::set<std::string>{"choudhury", "he", "karnopp"});

  const RandomLoop once = random_sticky_loop(5, 7, Load::wandering);
  const RandomLoop again = random_sticky_loop(5, 7, Load::wandering);
  CHECK(once.reported.model.scenario.seed == again.reported.model.scenario.seed);
  CHECK(once.reported.model.disturbances.size() == 1);
  CHECK(random_sticky_loop(6, 7, Load::steady).reported.model.process !=
        once.reported.model.process);
  CHECK(random_sticky_loop(5, 8, Load::steady).reported.model.process !=
        once.reported.model.process);
}

TEST_CASE("random healthy loops have the stated read-back", "[jacket][studies]") {
  for (std::size_t i = 0; i < 100; ++i) {
    const JacketTrial good = random_healthy_loop(5, i, ReadBackQuality::within_dead_zone);
    CHECK(good.model.valve_effects.front().name == "positioner_lag");
    CHECK(std::abs(good.read_back.bias) <= 0.02);
    CHECK(good.read_back.noise <= 0.005);
    const JacketTrial biased = random_healthy_loop(5, i, ReadBackQuality::biased);
    CHECK((std::abs(biased.read_back.bias) >= 0.1 && std::abs(biased.read_back.bias) <= 0.3));
    CHECK(random_healthy_loop(5, i, ReadBackQuality::noisy).read_back.noise == Approx(0.03));
    CHECK(biased.model.process == good.model.process);
  }
}

TEST_CASE("the studies don't depend on the number of threads", "[jacket][studies]") {
  std::size_t reported = 0;
  const StudyWork one{.threads = 1, .progress = {}};
  const StudyWork many{.threads = 3, .progress = [&](std::size_t done, std::size_t total) {
                         CHECK(total == 3);
                         reported = std::max(reported, done);
                       }};
  const StickyStudy a = study_sticky_loops(3, 4, Load::steady, one);
  const StickyStudy b = study_sticky_loops(3, 4, Load::steady, many);
  CHECK(reported == 3);
  REQUIRE(a.rows.size() == 5);
  REQUIRE(b.rows.size() == a.rows.size());
  for (std::size_t i = 0; i < a.rows.size(); ++i) {
    CHECK(a.rows[i].name == b.rows[i].name);
    CHECK(a.rows[i].rms_factor.median == b.rows[i].rms_factor.median);
    CHECK(a.rows[i].whole_rms_factor.worst == b.rows[i].whole_rms_factor.worst);
  }
}

TEST_CASE("dwell does not disturb healthy loops, whatever the read-back", "[jacket][studies]") {
  const std::vector<HealthyRow> rows = study_healthy_loops(20, 9, {.threads = 2, .progress = {}});
  REQUIRE(rows.size() == 9);
  for (const HealthyRow& row : rows) {
    if (row.form == JacketForm::dwell) {
      CHECK(row.worst_rise_percent < 0.05);
      CHECK(row.whole_rms_factor.worst < 1.03);
    }
    if (row.form == JacketForm::paper) CHECK(row.whole_rms_factor.median > 1.1);
  }
}

}  // namespace jacket_study_test
