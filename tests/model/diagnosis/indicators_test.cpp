// SPDX-License-Identifier: Apache-2.0
// Play and Hammerstein evidence on textbook cases, the decision, and the verdict of a loop.
#include <array>
#include <catch2/catch.hpp>
#include <vector>

#include "model/diagnosis/diagnosis.hpp"
#include "model/diagnosis/limits.hpp"
#include "model/effects/backlash/backlash.hpp"
#include "model/effects/stiction/stiction_choudhury.hpp"
#include "tests/model/diagnosis/signals.hpp"

namespace loopwarden::tests::indicators_test {
namespace {

using namespace diagnosis;

Series triangles() {
  return made_of(800, [](double k) { return triangle(k / 40.0); });
}
double play_of(const Series& pv, const Series& co) {
  return fit_play(three_time_scales(pv, 40.0), three_time_scales(co, 40.0), 40.0).evidence;
}

TEST_CASE("play: PV that lags by backlash is explained by it, other PV is not") {
  const Series co = triangles();
  effects::Backlash play(1.0);
  play.reset(0.0);
  Series behind;
  for (const double u : co) behind.push_back(play.step(u));
  const PlayFit fit = fit_play(three_time_scales(with_noise(behind, 0.03, 4), 40.0),
                               three_time_scales(co, 40.0), 40.0);
  CHECK(fit.evidence > 0.5);
  CHECK(fit.band == Approx(1.0).epsilon(0.25));
  CHECK(play_of(with_noise(co, 0.03, 5), co) < 0.0);
}

TEST_CASE("play: a short lag of transmitter and process is no band") {
  const Series co = triangles();
  Series lagging;
  double x = 0.0;
  for (const double u : co)
    lagging.push_back(x += (u - x) * (1.0 - std::exp(-1.0 / (0.04 * 40.0))));
  CHECK(play_of(with_noise(lagging, 0.03, 6), co) < 0.0);
}

TEST_CASE(
    "Hammerstein: a slipping valve predicts PV better in a closed loop, an ideal one does not") {
  const SmallLoop loop{.gain = 0.3, .integral_time = 2.0, .noise = 0.1};
  effects::StictionChoudhury valve({.s = 5.0, .j = 3.0});
  valve.reset(50.0);
  const SmallLoop::Run sticky = loop.run(
      1200, [&](double u) { return valve.step(u); }, [](double) { return 1.3; });
  const Hammerstein found = fit_hammerstein(sticky.pv, sticky.co);
  CHECK(found.evidence > DiagnosisLimits::kHammersteinVotes);
  CHECK(found.band == Approx(5.0).epsilon(0.4));
  const SmallLoop::Run cycling = loop.run(
      1200, [](double u) { return u; }, [](double t) { return 4.0 * sine(t / 25.0); });
  CHECK(fit_hammerstein(cycling.pv, cycling.co).evidence < DiagnosisLimits::kHammersteinVotes);
}

TEST_CASE("Hammerstein: CO that only echoes PV through the controller proves no effect") {
  // PV is a load; CO = -PV in the same block.
  numeric::Random random(6);
  double x = 0.0;
  Series pv;
  Series co;
  for (int k = 0; k < 1000; ++k) {
    pv.push_back(x = 0.95 * x + random.normal());
    co.push_back(-pv.back());
  }
  CHECK(fit_hammerstein(pv, co).evidence < DiagnosisLimits::kHammersteinVotes);
  CHECK(diagnose({.period_s = 1.0, .pv = pv, .co = co}).verdict != DiagnosisVerdict::valve_effect);
}

TEST_CASE("Hammerstein: one step does not hide the sticking in the other samples") {
  const SmallLoop loop{.gain = 0.3, .integral_time = 2.0, .noise = 0.1};
  effects::StictionChoudhury valve({.s = 5.0, .j = 3.0});
  valve.reset(50.0);
  // The load steps by more than a band.
  const SmallLoop::Run stepped = loop.run(
      1200, [&](double u) { return valve.step(u); },
      [](double t) { return t < 400.0 ? 1.3 : -5.0; });
  const Hammerstein found = fit_hammerstein(stepped.pv, stepped.co);
  CHECK(found.evidence > DiagnosisLimits::kHammersteinVotes);
  CHECK(found.parts_for >= 0.75);
  CHECK(found.band == Approx(5.0).epsilon(0.5));
}

TEST_CASE("Hammerstein: a valve that reverses less than twice is no evidence") {
  numeric::Random random(8);
  Series co;
  Series pv;
  effects::Backlash play(8.0);
  play.reset(0.0);
  for (int k = 0; k < 800; ++k) {
    co.push_back(k < 400 ? 0.05 * k : 20.0 - 0.02 * (k - 400));
    pv.push_back(play.step(co.back()) + 0.05 * random.normal());
  }
  const Hammerstein found = fit_hammerstein(pv, co);
  CHECK(found.evidence < 0.05);
}

TEST_CASE("Hammerstein: a gain that would be unstable under this controller does not count") {
  const SmallLoop loop{.gain = 0.3, .integral_time = 2.0, .noise = 0.1};
  effects::StictionChoudhury valve({.s = 5.0, .j = 3.0});
  valve.reset(50.0);
  const SmallLoop::Run sticky = loop.run(
      1200, [&](double u) { return valve.step(u); }, [](double) { return 1.3; });
  const double right = fit_hammerstein(sticky.pv, sticky.co, 1.0).evidence;
  CHECK(right > DiagnosisLimits::kHammersteinVotes);
  CHECK(fit_hammerstein(sticky.pv, sticky.co, -1.0).evidence < 0.5 * right);
}

const Reversals kByTravel{.count = 20, .travel_scatter = 0.1, .cycle_scatter = 0.3};
const Reversals kByTime{.count = 20, .travel_scatter = 0.3, .cycle_scatter = 0.1};
const Reversals kClockwork{
    .count = 20, .travel_scatter = 0.01, .cycle_scatter = 0.01, .four_cycle_scatter = 0.01};

ValveEvidence sticky_evidence() {
  return {.phase = 2.5, .play = 0.5, .hammerstein = 0.3, .standing = 0.7, .reversals = kByTravel};
}

TEST_CASE("a valve is seen if CO reverses by travel and PV is constant, otherwise it is likely") {
  const ValveEvidence e = sticky_evidence();
  CHECK(decide(e, Follows::at_once).grade == Grade::seen);
  ValveEvidence moving = e;
  moving.standing = 0.39;
  CHECK(decide(moving, Follows::at_once).grade == Grade::likely);
  ValveEvidence irregular = e;
  irregular.reversals = {};
  CHECK(decide(irregular, Follows::at_once).grade == Grade::likely);
  // In a slow process indicator A is needed as well.
  ValveEvidence slow = e;
  slow.hammerstein = 0.1;
  CHECK(decide(e, Follows::by_integration).grade == Grade::seen);
  CHECK(decide(slow, Follows::by_integration).grade != Grade::seen);
}

TEST_CASE("a swing with a constant period, or driven from outside, names no valve") {
  for (const Reversals& reversals : {kByTime, kClockwork}) {
    ValveEvidence e = sticky_evidence();
    e.phase = 4.0;
    e.standing = 0.9;
    e.reversals = reversals;
    for (const Follows follows : {Follows::at_once, Follows::by_integration, Follows::slowly}) {
      const ValveDecision d = decide(e, follows);
      CHECK(d.grade == Grade::none);
      if (follows != Follows::at_once) continue;
      CHECK(d.undecided);
      CHECK_FALSE(d.reason.empty());
      CHECK_FALSE(d.settle.empty());
    }
  }
  // A swing doesn't count for indicator A.
  ValveEvidence swing{
      .phase = -1.0, .play = 0.0, .hammerstein = 0.5, .standing = 0.1, .reversals = kByTime};
  const double p = decide(swing, Follows::at_once).probability;
  swing.hammerstein = 0.0;
  CHECK(decide(swing, Follows::at_once).probability == p);
}

TEST_CASE("PV that does not depend on CO has no information about the valve") {
  ValveEvidence noise = sticky_evidence();
  noise.relation = 0.15;
  const ValveDecision d = decide(noise, Follows::at_once);
  CHECK(d.grade == Grade::none);
  CHECK_FALSE(d.undecided);
  CHECK(d.probability <= DiagnosisLimits::kUnrelatedMost);
}

TEST_CASE("a band that play and prediction show counts even if set points carry PV along") {
  const ValveEvidence carried{.phase = -4.4, .play = 0.25, .hammerstein = 0.4, .standing = 0.2};
  CHECK(decide(carried, Follows::at_once).grade == Grade::likely);
  for (double ValveEvidence::*one : {&ValveEvidence::play, &ValveEvidence::hammerstein}) {
    ValveEvidence less = carried;
    less.*one = 0.1;
    CHECK(decide(less, Follows::at_once).grade == Grade::none);
  }
}

TEST_CASE("without a band PV that lags CO is no sticking valve") {
  const ValveEvidence random_load{
      .phase = 4.0, .play = 0.0, .hammerstein = 0.05, .standing = 0.6, .reversals = kByTravel};
  CHECK(decide(random_load, Follows::at_once).probability <= DiagnosisLimits::kDecidedBelow);
  ValveEvidence banded = random_load;
  banded.play = 0.3;
  CHECK(decide(banded, Follows::at_once).probability > DiagnosisLimits::kDecidedBelow);
}

TEST_CASE("PV in step with CO that no stick band predicts is no sticking valve") {
  // A fast loop in a log with held values: play seems to explain them.
  const ValveEvidence held{.phase = -4.0, .play = 0.8, .hammerstein = 0.1, .standing = 0.9};
  CHECK(decide(held, Follows::at_once).probability <= DiagnosisLimits::kDecidedBelow);
  ValveEvidence later = held;
  later.phase = -1.9;
  CHECK(decide(later, Follows::at_once).probability > DiagnosisLimits::kDecidedBelow);
}

TEST_CASE("the decision rises with every indicator and stays within its bounds") {
  const ValveEvidence base{.phase = -1.0, .play = 0.01, .hammerstein = 0.05, .standing = 0.2};
  const double p = decide(base, Follows::at_once).probability;
  const auto more = [&](auto change) {
    ValveEvidence e = base;
    change(e);
    return decide(e, Follows::at_once).probability;
  };
  CHECK(more([](ValveEvidence& e) { e.phase = 0.0; }) > p);
  CHECK(more([](ValveEvidence& e) { e.play = 0.5; }) > p);
  CHECK(more([](ValveEvidence& e) { e.standing = 0.6; }) > p);
  CHECK(more([](ValveEvidence& e) { e.hammerstein = 0.2; }) > p);
  CHECK(decide({.phase = 4.6, .play = 1.0, .hammerstein = 0.5, .standing = 0.9}, Follows::at_once)
            .probability == DiagnosisLimits::kMostProbability);
  CHECK(decide({.phase = -4.6, .play = -1.0, .hammerstein = -0.1}, Follows::at_once).probability ==
        DiagnosisLimits::kLeastProbability);
}

TEST_CASE("a level is accused only if it cycles and PV is constant while CO moves") {
  for (const Follows follows : {Follows::by_integration, Follows::slowly}) {
    CHECK(decide(sticky_evidence(), follows).grade == Grade::seen);
    ValveEvidence wanders = sticky_evidence();
    wanders.reversals = {.count = 20, .travel_scatter = 0.8, .cycle_scatter = 0.9};
    ValveEvidence never_stands = sticky_evidence();
    never_stands.standing = 0.04;
    for (const ValveEvidence& e : {wanders, never_stands}) {
      const ValveDecision d = decide(e, follows);
      CHECK(d.grade == Grade::none);
      CHECK(d.undecided);
      CHECK_FALSE(d.settle.empty());
    }
    // A cycle without an external swing need not reverse by travel.
    ValveEvidence cycles = sticky_evidence();
    cycles.reversals = {.count = 20, .travel_scatter = 0.3, .cycle_scatter = 0.35};
    CHECK(decide(cycles, follows).grade == Grade::likely);
    // If PV follows at once, the valve may stick in any kind of movement.
    CHECK(decide(wanders, Follows::at_once).grade == Grade::likely);
  }
}

TEST_CASE("phase and play name no valve on a level without other evidence") {
  ValveEvidence odd = sticky_evidence();
  odd.hammerstein = -0.1;
  for (const Follows follows : {Follows::by_integration, Follows::slowly}) {
    const ValveDecision d = decide(odd, follows);
    CHECK(d.grade == Grade::none);
    CHECK(d.undecided);
    CHECK_FALSE(d.settle.empty());
  }
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
}  // namespace loopwarden::tests::indicators_test
