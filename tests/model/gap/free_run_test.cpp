// SPDX-License-Identifier: Apache-2.0
#include "model/gap/free_run.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <cmath>
#include <string>
#include <vector>

#include "tests/model/gap/gap_support.hpp"

namespace free_run_test {

using namespace loopwarden;
using namespace loopwarden::gap;
using namespace loopwarden::test;
namespace effects = loopwarden::effects;

namespace {

constexpr std::size_t kSamples = 700;

// A model with content in every block.
plant::LoopModel full_model() {
  plant::LoopModel m = believed_model();
  m.valve_effects = {{"backlash", {{"deadband", 0.2}}},
                     {"valve_characteristic", {}, {{"curve", "butterfly"}}}};
  m.process_effects = {{"extra_lag", {{"time_constant", 0.5}}}};
  m.transmitter_effects = {{"extra_lag", {{"time_constant", 0.4}}},
                           {"output_bias", {{"bias", 0.3}}}};
  m.disturbances = {{"oscillating_disturbance", {{"amplitude", 0.2}, {"period", 7.0}}}};
  return m;
}

Point nominal(const plant::LoopModel& m) {
  Point point;
  point.time_constant_s = m.process.time_constant_s;
  point.dead_time_s = m.process.dead_time_s;
  return point;
}

std::vector<double> combined(const FreeRun& run, const Terms& terms, const Point& point,
                             const std::vector<double>& solved) {
  std::vector<std::vector<double>> columns;
  run.columns(terms, point, columns);
  REQUIRE(columns.size() == run.column_count(terms));
  std::vector<double> pv = run.offset();
  for (std::size_t i = 0; i < columns.size(); ++i) {
    for (std::size_t k = 0; k < pv.size(); ++k) pv[k] += solved[i] * columns[i][k];
  }
  return pv;
}

double farthest(const std::vector<double>& a, const std::vector<double>& b, std::size_t from = 0) {
  REQUIRE(a.size() == b.size());
  double most = 0.0;
  for (std::size_t k = from; k < a.size(); ++k) most = std::max(most, std::abs(a[k] - b[k]));
  return most;
}

// Wide, so that clamping never occurs.
plant::LoopModel unlimited(plant::LoopModel m) {
  m.transmitter.low = -100.0;
  m.transmitter.high = 100.0;
  return m;
}

}  // namespace

TEST_CASE("the free run equals the plant under the same CO", "[gap][free_run]") {
  const plant::LoopModel m = unlimited(GENERATE(believed_model(), full_model()));
  const std::vector<double> co = exciting_output(kSamples);
  const FreeRun run(m, co);
  CHECK(run.size() == kSamples);
  CHECK(farthest(combined(run, {}, nominal(m), {1.0, 0.0, 0.0}), driven(m, co)) < 1e-9);
}

TEST_CASE("a model that can't be stepped is refused, its random load left out", "[gap][free_run]") {
  plant::LoopModel m = believed_model();
  const std::vector<double> co = exciting_output(100);
  m.disturbances = {{"random_load", {{"intensity", 0.1}}}};
  CHECK(FreeRun(m, co).offset() == std::vector<double>(100, 0.0));
  m.valve_effects = {{"stiction", {{"s", 1.0}, {"j", 2.0}}}};
  CHECK_THROWS_AS(FreeRun(m, co), effects::EffectError);
}

TEST_CASE("the corrected model runs as the fit does", "[gap][free_run]") {
  const plant::LoopModel m = unlimited(GENERATE(believed_model(), full_model()));
  const std::vector<double> co = exciting_output(kSamples);
  const FreeRun run(m, co);
  const std::vector<Candidate> all = candidates_for(m, co);
  for (const Candidate& candidate : all) {
    const Candidate& second =
        of_name(all, candidate.block == effects::Block::valve ? "drift" : "positioner_overshoot");
    CAPTURE(candidate.name, &candidate - all.data());
    const Terms terms{&candidate, &second};
    Point point = nominal(m);
    point.time_constant_s *= 1.04;
    point.dead_time_s *= 0.97;
    point.actuator_frequency = candidate.with_momentum != nullptr ? 8.0 : 0.0;
    std::vector<double> solved{1.03, 0.0, 0.0};  // at rest before the record
    for (const Candidate* term : terms) {
      point.searched.emplace_back();
      for (const effects::SearchRange& range : term->search) {
        const bool start = std::string(range.name) == "start";
        point.searched.back().push_back(start ? 0.0 : range.value(0.4));
      }
      for (std::size_t i = 0; i < term->linear_columns(); ++i) {
        solved.push_back(0.01 + 0.02 * static_cast<double>(i));
      }
    }
    if (candidate.solves_gain) solved[0] = 1.7;
    const plant::LoopModel corrected = run.corrected(terms, point, solved);
    // The plant rests at the start without the sine's phase; the fit has the sine from the first
    // sample on. The transmitter's lag forgets the difference.
    const std::size_t from = candidate.columns == 2 ? 80 : 0;
    std::vector<double> pv = combined(run, terms, point, solved);
    run.show(terms, point, pv);
    // A lag that is a term does not pass on the movement of the model's own offset.
    const bool lags_offset = std::string(candidate.name) == "plugging" && !m.disturbances.empty();
    CHECK(farthest(pv, driven(corrected, co), from) < (lags_offset ? 0.04 : 1e-6));
    if (candidate.solves_gain) {
      CHECK(corrected.process.gain == m.process.gain);
      CHECK(corrected.process_effects.back().parameters.at("factor") == 1.7);
    } else {
      CHECK(corrected.process.gain == Approx(1.03 * m.process.gain));
    }
  }
}

TEST_CASE("effects of the valve are in the order of the signal", "[gap][free_run]") {
  plant::LoopModel m = believed_model();
  m.valve_effects = {{"valve_characteristic", {}, {{"curve", "butterfly"}}}};
  const std::vector<double> co = exciting_output(100);
  const FreeRun run(m, co);
  const std::vector<Candidate> all = candidates_for(m, co);
  const Terms terms{&of_name(all, "stiction"), &of_name(all, "positioner_overshoot"),
                    &of_name(all, "low_air_supply")};
  Point point = nominal(m);
  point.actuator_frequency = 9.0;
  point.actuator_damping = 0.4;
  point.searched = {{1.0, 0.4, 0.0}, {0.5, 2.0}, {1.0, 8.0, 0.5}};
  const plant::LoopModel corrected = run.corrected(terms, point, {1.0, 0.0, 0.0});
  std::vector<std::string> names;
  for (const effects::EffectSpec& spec : corrected.valve_effects) names.push_back(spec.name);
  CHECK(names == std::vector<std::string>{"positioner_overshoot", "low_air_supply", "stiction",
                                          "valve_characteristic"});
  // The stem that sticks has the actuator's momentum.
  const effects::EffectSpec& stiction = corrected.valve_effects[2];
  CHECK(stiction.options.at("law") == "inertial");
  CHECK(stiction.parameters.at("natural_frequency") == 9.0);
  CHECK(stiction.parameters.at("damping") == 0.4);
  CHECK(stiction.parameters.at("j") == Approx(0.4));
}

TEST_CASE("an effect of the valve takes the place of the model's own of that name",
          "[gap][free_run]") {
  plant::LoopModel m = believed_model();
  m.valve_effects = {{"backlash", {{"deadband", 0.3}}}};
  const std::vector<double> co = exciting_output(100);
  const std::vector<Candidate> all = candidates_for(m, co);
  const Terms terms{&of_name(all, "backlash")};
  Point point = nominal(m);
  point.searched = {{0.9, 0.0}};
  const plant::LoopModel corrected = FreeRun(m, co).corrected(terms, point, {1.0, 0.0, 0.0});
  REQUIRE(corrected.valve_effects.size() == 1);
  CHECK(corrected.valve_effects[0].parameters.at("deadband") == 0.9);
}

TEST_CASE("the unknown past dies out with the process and after the dead time", "[gap][free_run]") {
  const plant::LoopModel m = believed_model();
  const std::vector<double> co = exciting_output(200);
  std::vector<std::vector<double>> columns;
  FreeRun(m, co).columns({}, nominal(m), columns);
  const double keep = std::exp(-m.sample_time_s / m.process.time_constant_s);
  CHECK(columns[1][0] == 1.0);
  CHECK(columns[1][10] == Approx(std::pow(keep, 10)));
  CHECK(columns[2][8] == 1.0);  // 0.8 s of dead time
  CHECK(columns[2][13] == Approx(std::pow(keep, 5)).epsilon(1e-9));
}

TEST_CASE("a stem that rests apart from CO at the start shifts the whole beginning",
          "[gap][free_run]") {
  const plant::LoopModel m = believed_model();
  const std::vector<double> co(300, 5.0);
  const FreeRun run(m, co);
  const std::vector<Candidate> all = candidates_for(m, exciting_output(300));
  const Terms terms{&of_name(all, "backlash")};
  Point point = nominal(m);
  point.searched = {{1.0, 0.8}};  // 0.8 of half the deadband
  std::vector<std::vector<double>> columns;
  run.columns(terms, point, columns);
  for (const double z : columns[0]) REQUIRE(z == Approx(m.process.gain * (5.0 - 0.4)));
}

TEST_CASE("short runs fit best at the true stickband", "[gap][free_run]") {
  plant::LoopModel truth = believed_model();
  const double s = 1.2;
  const double ratio = 0.4;
  truth.valve_effects = {
      {"stiction",
       {{"s", s}, {"j", s * ratio}, {"natural_frequency", 12.0}, {"damping", 0.3}},
       {{"law", "inertial"}}}};
  const std::vector<double> co = exciting_output(kSamples);
  const std::vector<double> pv = driven(truth, co);
  const plant::LoopModel m = believed_model();
  const FreeRun run(m, co);
  const std::vector<Candidate> all = candidates_for(m, co);
  const Terms terms{&of_name(all, "stiction")};
  Point point = nominal(m);
  point.actuator_frequency = 12.0;
  point.actuator_damping = 0.3;
  const auto left = [&](double at_s, double gain,
                        double most = std::numeric_limits<double>::infinity()) {
    point.searched = {{at_s, ratio, 0.0}};
    return run.short_runs(terms, point, pv, std::vector<bool>(kSamples, true), gain, 230, most);
  };
  const double best = left(s, 1.0);
  CHECK(left(s, 1.0, 1.01 * best) == best);
  CHECK(left(s, 1.0, 0.5 * best) >= 0.5 * best);
  CHECK(best < 0.3 * left(0.6 * s, 1.0));
  CHECK(best < 0.3 * left(1.6 * s, 1.0));
  CHECK(best < 0.3 * left(s, 1.2));
}

}  // namespace free_run_test
