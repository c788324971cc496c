// SPDX-License-Identifier: Apache-2.0
// The decision about a valve, and the verdict of a loop.
#include <array>
#include <catch2/catch.hpp>
#include <vector>

#include "model/diagnosis/diagnosis.hpp"
#include "model/diagnosis/limits.hpp"

namespace loopwarden::tests::decision_test {
namespace {

using namespace diagnosis;

const Reversals kByTravel{.count = 20, .travel_scatter = 0.1, .cycle_scatter = 0.3};
const Reversals kByTime{.count = 20, .travel_scatter = 0.3, .cycle_scatter = 0.1};
const Reversals kClockwork{
    .count = 20, .travel_scatter = 0.01, .cycle_scatter = 0.01, .four_cycle_scatter = 0.01};

ValveEvidence sticky_evidence() {
  return {
      .log_odds = 20.0, .share = 0.5, .explained = 0.6, .standing = 0.7, .reversals = kByTravel};
}

TEST_CASE("a valve is seen if the band is certain and PV rests, otherwise it is likely") {
  const ValveEvidence e = sticky_evidence();
  CHECK(decide(e).grade == Grade::seen);
  ValveEvidence moving = e;
  moving.standing = 0.2;
  CHECK(decide(moving).grade == Grade::likely);
  ValveEvidence weak = e;
  weak.log_odds = 6.0;
  CHECK(decide(weak).grade == Grade::likely);
  weak.log_odds = 2.0;
  CHECK(decide(weak).undecided);
  ValveEvidence by_chance = e;
  by_chance.explained = -0.5;
  CHECK(decide(by_chance).undecided);
}

TEST_CASE(
    "a slip jump names a valve effect if an oscillation or a disturbance moves the loop too") {
  ValveEvidence e = sticky_evidence();
  e.jump = 10.0;
  e.explained = -0.5;
  CHECK(decide(e).grade == Grade::seen);
  e.reversals = kByTime;
  CHECK(decide(e).grade == Grade::seen);
  e.reversals = kClockwork;
  CHECK(decide(e).undecided);
  e.reversals = kByTime;
  e.log_odds = 2.0;
  CHECK(decide(e).grade == Grade::none);
}

TEST_CASE("no valve is named if an external oscillation moves CO") {
  for (const Reversals& reversals : {kByTime, kClockwork}) {
    ValveEvidence e = sticky_evidence();
    e.reversals = reversals;
    const ValveDecision d = decide(e);
    CHECK(d.grade == Grade::none);
    CHECK(d.undecided);
    CHECK(d.by_cycle);
    e.log_odds = 0.0;
    CHECK_FALSE(decide(e).undecided);
    CHECK(decide(e).probability <= DiagnosisLimits::kDecidedBelow);
  }
}

TEST_CASE("more evidence never makes a valve effect less probable") {
  const ValveEvidence base{.log_odds = 0.0, .standing = 0.3};
  const double p = decide(base).probability;
  const auto more = [&](auto&& change) {
    ValveEvidence e = base;
    change(e);
    return decide(e).probability;
  };
  CHECK(more([](ValveEvidence& e) { e.log_odds = 5.0; }) > p);
  CHECK(more([](ValveEvidence& e) { e.log_odds = -5.0; }) < p);
  CHECK(more([](ValveEvidence& e) { e.standing = 0.6; }) > p);
  CHECK(more([](ValveEvidence& e) { e.reversals = kByTravel; }) > p);
  CHECK(more([](ValveEvidence& e) { e.reversals = kByTime; }) < p);
  CHECK(decide({.log_odds = 1e3, .standing = 1.0}).probability ==
        DiagnosisLimits::kMostProbability);
  CHECK(decide({.log_odds = -1e3}).probability >= DiagnosisLimits::kLeastProbability);
}

Diagnosis window(DiagnosisVerdict verdict, double probability, Grade grade = Grade::none) {
  Diagnosis d;
  d.verdict = verdict;
  d.probability = probability;
  d.grade = grade;
  if (grade != Grade::none) d.cause = Cause::stiction;
  return d;
}

TEST_CASE("a loop's verdict combines its windows, with the time since its cause") {
  const auto healthy = window(DiagnosisVerdict::healthy, 0.1);
  const auto sticky = window(DiagnosisVerdict::valve_effect, 0.9, Grade::seen);
  const auto open = window(DiagnosisVerdict::cant_tell, 0.5);
  const auto none = window(DiagnosisVerdict::not_enough_data, 0.5);
  const std::vector<Diagnosis> later{healthy, sticky, open, sticky, sticky};
  const LoopVerdict found = judge_loop(later);
  CHECK(found.verdict == DiagnosisVerdict::valve_effect);
  CHECK(found.grade == Grade::seen);
  CHECK(found.since == 1);
  CHECK(found.like == 4);
  const std::vector<Diagnosis> once{healthy, sticky, healthy, healthy};
  CHECK(judge_loop(once).verdict == DiagnosisVerdict::healthy);
  const std::vector<Diagnosis> undecided{open, none, open};
  CHECK(judge_loop(undecided).verdict == DiagnosisVerdict::cant_tell);
  const std::vector<Diagnosis> empty{none, none};
  CHECK(judge_loop(empty).verdict == DiagnosisVerdict::not_enough_data);
}

TEST_CASE("the trend of the size is the median slope of the windows that show the effect") {
  std::vector<Diagnosis> windows(5, window(DiagnosisVerdict::valve_effect, 0.9, Grade::seen));
  const std::array<double, 5> sizes{1.0, 1.5, 0.0, 2.5, 9.0};
  for (std::size_t i = 0; i < windows.size(); ++i) windows[i].s = sizes[i];
  windows[0] = windows[2] = window(DiagnosisVerdict::healthy, 0.1);
  const SizeTrend trend = size_trend(windows);
  CHECK(trend.windows == 3);
  CHECK(trend.first == 1.5);
  CHECK(trend.last == 9.0);
  // Slopes 0.5, 2.5, 6.5.
  CHECK(trend.per_window == Approx(2.5));
  CHECK(size_trend({}).windows == 0);
}

}  // namespace
}  // namespace loopwarden::tests::decision_test
