// SPDX-License-Identifier: Apache-2.0
// Verdicts on loops with a known cause.
#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>
#include <span>
#include <vector>

#include "model/diagnosis/diagnosis.hpp"
#include "model/diagnosis/features.hpp"
#include "model/numeric/statistics.hpp"
#include "model/effects/backlash/backlash.hpp"
#include "model/effects/stiction/stiction_choudhury.hpp"
#include "model/effects/stiction/stiction_karnopp.hpp"
#include "tests/model/diagnosis/signals.hpp"

namespace loopwarden::tests::diagnosis_test {
namespace {

using namespace diagnosis;

// Keeps a sticking valve from resting at the set point by chance.
const auto kSteadyLoad = [](double) { return 1.3; };
const auto kIdeal = [](double u) { return u; };

Diagnosis diagnosed(const SmallLoop::Run& run, double sample_time_s = 0.5) {
  return diagnose({.period_s = sample_time_s, .pv = run.pv, .co = run.co});
}

TEST_CASE("a sticking valve is named, with its band, whatever the units") {
  effects::StictionKarnopp valve({.s = 4.0, .j = 3.0}, 0.5);
  valve.reset(50.0);
  const SmallLoop loop{.gain = 0.3, .integral_time = 2.0};
  SmallLoop::Run run = loop.run(
      1200, [&](double u) { return valve.step(u); }, kSteadyLoad);
  const Diagnosis d = diagnosed(run);
  CHECK(d.verdict == DiagnosisVerdict::valve_effect);
  CHECK(d.cause == Cause::stiction);
  CHECK(d.oscillating);
  CHECK(d.s == Approx(4.0).epsilon(0.35));
  for (double& v : run.pv) v = -3.0 + 700.0 * v;
  const Diagnosis scaled = diagnosed(run, 60.0);
  CHECK(scaled.probability == Approx(d.probability).margin(1e-6));
  CHECK(scaled.period_s == Approx(120.0 * d.period_s));
  CHECK(scaled.s == Approx(d.s));
}

TEST_CASE("the direction of the controller doesn't change the verdict") {
  effects::StictionChoudhury valve({.s = 5.0, .j = 3.0});
  valve.reset(50.0);
  SmallLoop::Run run = SmallLoop{.gain = 0.3, .integral_time = 2.0}.run(
      1200, [&](double u) { return valve.step(u); }, wandering_load(1.3));
  const Diagnosis before = diagnosed(run);
  for (double& u : run.co) u = 100.0 - u;
  CHECK(before.verdict == DiagnosisVerdict::valve_effect);
  CHECK(diagnosed(run).verdict == before.verdict);
  CHECK(diagnosed(run).probability == Approx(before.probability).margin(0.05));
}

TEST_CASE("the reversals of CO in all windows of a loop overrule those of one window") {
  effects::StictionKarnopp valve({.s = 4.0, .j = 3.0}, 0.5);
  valve.reset(50.0);
  const Diagnosis sticky = diagnosed(SmallLoop{.gain = 0.3, .integral_time = 2.0}.run(
      1200, [&](double u) { return valve.step(u); }, kSteadyLoad));
  REQUIRE(sticky.verdict == DiagnosisVerdict::valve_effect);
  const auto shared = [&](const Reversals& first, const Reversals& second) {
    std::vector<Diagnosis> windows(2, sticky);
    windows[0].evidence.reversals = first;
    windows[1].evidence.reversals = second;
    std::vector<Diagnosis*> together{&windows[0], &windows[1]};
    share_reversals(together);
    return windows[0].verdict;
  };
  // Neither window has enough cycles to show that the phase is kept.
  const Reversals kept{
      .count = 8, .travel_scatter = 0.01, .cycle_scatter = 0.01, .four_cycle_scatter = 0.02};
  REQUIRE(kept.by() == ReversalsBy::neither);
  CHECK(shared(kept, kept) == DiagnosisVerdict::cant_tell);
  // A window that looks like an external oscillation by chance, among others that don't.
  const Reversals swings{.count = 10, .travel_scatter = 0.5, .cycle_scatter = 0.2};
  const Reversals wanders{.count = 60, .travel_scatter = 0.8, .cycle_scatter = 0.9};
  REQUIRE(swings.by() == ReversalsBy::time);
  CHECK(shared(swings, wanders) == DiagnosisVerdict::valve_effect);
}

TEST_CASE("a load that oscillates is no valve effect") {
  const Diagnosis d = diagnosed(SmallLoop{.gain = 0.5, .integral_time = 3.0}.run(
      1500, kIdeal, [](double t) { return 4.0 * sine(t / 25.0); }));
  CHECK(d.verdict == DiagnosisVerdict::other_cause);
  CHECK(d.cause == Cause::disturbance);
  CHECK(d.oscillating);
  CHECK(d.period_s == Approx(25.0).epsilon(0.05));
}

TEST_CASE("tight tuning is no valve effect") {
  numeric::Random random(9);
  const Diagnosis d = diagnosed(SmallLoop{.gain = 3.3, .integral_time = 4.0}.run(
      1500, kIdeal, [&](double) { return 0.1 * random.normal(); }));
  CHECK(d.verdict == DiagnosisVerdict::other_cause);
  CHECK(d.cause == Cause::tuning);
}

TEST_CASE("a loop under random load is healthy") {
  numeric::Random random(4);
  double wander = 0.0;
  const Diagnosis d = diagnosed(SmallLoop{.gain = 0.5, .integral_time = 3.0}.run(
      1500, kIdeal, [&](double) { return wander = 0.98 * wander + 0.3 * random.normal(); }));
  CHECK(d.verdict == DiagnosisVerdict::healthy);
  CHECK_FALSE(d.oscillating);
}

TEST_CASE("a valve at its end is called saturation") {
  SmallLoop loop{.gain = 0.5, .integral_time = 3.0};
  SmallLoop::Run run = loop.run(
      1500, [](double u) { return u; }, [](double t) { return 48.0 + 8.0 * sine(t / 60.0); });
  CHECK(diagnosed(run).cause == Cause::saturation);
}

TEST_CASE("too little data is reported instead of guessed") {
  const Series pv(50, 1.0);
  const Diagnosis d = diagnose({.period_s = 1.0, .pv = pv, .co = pv});
  CHECK(d.verdict == DiagnosisVerdict::not_enough_data);
  CHECK_FALSE(d.reason.empty());
}

TEST_CASE("the same record gives the same answer") {
  effects::Backlash valve(3.0);
  valve.reset(50.0);
  const SmallLoop::Run run = SmallLoop{}.run(
      500, [&](double u) { return valve.step(u); }, kSteadyLoad);
  CHECK(diagnosed(run).evidence.log_odds == diagnosed(run).evidence.log_odds);
  CHECK(diagnosed(run).probability == diagnosed(run).probability);
}

TEST_CASE("a healthy flow valve whose set point moves is healthy, a sticking one is found") {
  effects::StictionChoudhury valve({.s = 8.0, .j = 4.0});
  for (const bool sticky : {false, true}) {
    // An operator moves the set point, and PV follows within a second.
    numeric::Random random(3);
    valve.reset(50.0);
    Series pv;
    Series co;
    Series sp;
    double integral = 50.0;
    double x = 50.0;
    for (int k = 0; k < 1000; ++k) {
      sp.push_back(50.0 + 6.0 * std::floor(3.0 * sine(static_cast<double>(k) / 330.0)) / 3.0);
      pv.push_back(x + 0.2 * random.normal());
      const double error = sp.back() - pv.back();
      integral += 0.1 * error;
      co.push_back(integral + 0.2 * error);
      x += 0.6 * ((sticky ? valve.step(co.back()) : co.back()) - x);
    }
    const Diagnosis d = diagnose({.period_s = 1.0, .pv = pv, .sp = sp, .co = co}, LoopType::flow);
    CHECK((d.verdict == DiagnosisVerdict::valve_effect) == sticky);
  }
}

TEST_CASE("a level whose set point moves is no valve effect, with its kind given or not") {
  numeric::Random random(5);
  Series pv;
  Series co;
  Series sp;
  double level = 50.0;
  double integral = 30.0;
  for (int k = 0; k < 900; ++k) {
    sp.push_back(k < 400 ? 50.0 : 51.0);
    pv.push_back(level + 0.01 * random.normal());
    const double error = sp.back() - pv.back();
    integral += 0.05 * error;
    co.push_back(integral + 5.0 * error);
    level += 0.004 * (co.back() - 30.0);
  }
  for (const LoopType kind : {LoopType::level, LoopType::unknown}) {
    const Diagnosis d = diagnose({.period_s = 1.0, .pv = pv, .sp = sp, .co = co}, kind);
    CHECK(d.verdict != DiagnosisVerdict::valve_effect);
  }
}

TEST_CASE("a dead line, a dead transmitter and a clamped valve have separate answers") {
  numeric::Random random(8);
  Series co;
  double u = 40.0;
  for (int k = 0; k < 600; ++k) co.push_back(u += 0.3 * random.normal());
  Series sp(600, 25.0);
  const Series nothing = with_noise(Series(600, 0.0), 0.05, 9);
  const Diagnosis dead_line = diagnose({.period_s = 1.0, .pv = nothing, .sp = sp, .co = co});
  CHECK(dead_line.verdict == DiagnosisVerdict::other_cause);
  CHECK(dead_line.cause == Cause::no_flow);
  Series frozen = with_noise(Series(600, 25.0), 0.5, 9);
  std::fill(frozen.begin() + 300, frozen.end(), 25.5);
  CHECK(diagnose({.period_s = 1.0, .pv = frozen, .sp = sp, .co = co}).cause == Cause::sensor);
  Series clamped = co;
  for (double& v : clamped) v = std::min(v, numeric::quantile(co, 0.4));
  const Series pv = with_noise(Series(600, 25.0), 0.5, 9);
  CHECK(diagnose({.period_s = 1.0, .pv = pv, .co = clamped}).cause == Cause::saturation);
  CHECK(diagnose({.period_s = 1.0, .pv = pv, .co = co}).cause != Cause::saturation);
}

// A loop whose CO is at `rest` from `from` to `to`, with PV off SP by `off` in that time. Otherwise
// it cycles about SP.
struct Resting {
  Series pv, sp, co;
  numeric::LoopView record(bool with_sp) const {
    return {.period_s = 1.0,
            .pv = pv,
            .sp = with_sp ? std::span<const double>(sp) : std::span<const double>(),
            .co = co};
  }
};

Resting resting(std::size_t from, std::size_t to, double rest, double off) {
  Resting r{.pv = with_noise(made_of(900, [](double k) { return 50.0 + sine(k / 90.0); }), 0.1, 3),
            .sp = Series(900, 50.0),
            .co = made_of(900, [](double k) { return 60.0 + 4.0 * sine(k / 90.0 + 0.3); })};
  for (std::size_t k = from; k < to; ++k) {
    r.co[k] = rest;
    r.pv[k] = 50.0 + off + 0.1 * sine(static_cast<double>(k) / 7.0);
  }
  return r;
}

TEST_CASE("CO at a limit for more than a third is saturation, in one piece or the whole record") {
  for (const auto& [from, to] : {std::pair{200, 750}, {0, 900}, {0, 400}, {500, 900}}) {
    for (const double rest : {100.0, 0.0, 99.95}) {
      const Resting r = resting(static_cast<std::size_t>(from), static_cast<std::size_t>(to), rest,
                                rest > 50.0 ? -8.0 : 25.0);
      INFO(from << " to " << to << " at " << rest);
      CHECK(diagnose(r.record(true)).cause == Cause::saturation);
      CHECK(diagnose(r.record(false)).cause == Cause::saturation);
    }
  }
  // PV is a little below SP, but not by many times its noise.
  for (const double off : {-0.6, -1.0}) {
    Resting r = resting(200, 750, 100.0, 0.0);
    const Series noisy = with_noise(Series(900, 50.0 + off), 0.15, 5);
    std::copy(noisy.begin() + 200, noisy.begin() + 750, r.pv.begin() + 200);
    INFO(off);
    CHECK(diagnose(r.record(true)).cause == Cause::saturation);
  }
  // An output limit below the end of the span with a stopped controller: PV stays far from SP.
  for (const double rest : {85.0, 30.0}) {
    CHECK(diagnose(resting(200, 750, rest, -8.0).record(true)).cause == Cause::saturation);
    CHECK(diagnose(resting(0, 900, rest, -8.0).record(true)).cause == Cause::saturation);
  }
}

TEST_CASE("CO at rest is no saturation if PV is at SP, the valve is shut, or too little is known") {
  for (const double rest : {100.0, 60.0}) {
    CHECK(diagnose(resting(200, 750, rest, 0.0).record(true)).cause != Cause::saturation);
    CHECK(diagnose(resting(0, 900, rest, 0.0).record(true)).cause != Cause::saturation);
  }
  CHECK(diagnose(resting(200, 750, 60.0, -0.6).record(true)).cause != Cause::saturation);
  CHECK(diagnose(resting(200, 750, 60.0, -8.0).record(false)).cause != Cause::saturation);
  // Shut on purpose: no flow, although SP was not changed.
  CHECK(diagnose(resting(200, 750, 0.0, -50.0).record(true)).cause != Cause::saturation);
  CHECK(diagnose(resting(0, 900, 0.0, -50.0).record(true)).cause != Cause::saturation);
  // In manual according to a mode column: those samples are missing.
  Resting manual = resting(300, 750, 100.0, -8.0);
  for (std::size_t k = 300; k < 750; ++k) manual.pv[k] = manual.co[k] = std::nan("");
  CHECK(diagnose(manual.record(true)).cause != Cause::saturation);
  CHECK(diagnose(resting(300, 500, 100.0, -8.0).record(true)).cause != Cause::saturation);
}

TEST_CASE("windows at a limit for more than a third of a loop decide, a healthy window does not") {
  std::vector<Diagnosis> windows;
  for (const std::size_t to : {0UL, 900UL, 900UL}) {
    windows.push_back(diagnose(resting(0, to, 100.0, -8.0).record(true)));
  }
  CHECK(windows.front().judged());
  CHECK(judge_loop(windows).cause == Cause::saturation);
  CHECK(judge_loop(std::span(windows).first(1)).cause != Cause::saturation);
}

TEST_CASE("evidence is finite on records at the edge") {
  const auto finite = [](const Series& pv, const Series& co) {
    const Diagnosis d = diagnose({.period_s = 1.0, .pv = pv, .co = co});
    if (d.prepared.gate == Gate::open) {
      for (const double v : find_features(d.prepared, d.evidence)) {
        if (!std::isfinite(v)) return false;
      }
    }
    return std::isfinite(d.probability) && std::isfinite(d.evidence.log_odds) &&
           std::isfinite(d.evidence.explained) && std::isfinite(d.band.band);
  };
  const Series ramp = made_of(300, [](double k) { return k; });
  Series pulse(300, 0.0);
  pulse[150] = 1.0;
  const Series fast = made_of(300, [](double k) { return std::fmod(k, 2.0); });
  CHECK(finite(ramp, ramp));
  CHECK(finite(pulse, ramp));
  CHECK(finite(ramp, pulse));
  CHECK(finite(fast, fast));
  CHECK(finite(with_noise(Series(100, 0.0), 1e-9, 1), with_noise(Series(100, 0.0), 1e9, 2)));
}

TEST_CASE("a tree sends a feature left at its threshold and right above it") {
  Tree tree;
  tree.feature = {2, 0, 1, 0, 0, 0, 0};
  tree.threshold = {0.5F, 1.0F, -1.0F, 0.0F, 2.0F, 0.0F, 3.0F};
  Features e{};
  e[2] = 0.5;
  CHECK(leaf_of(tree, e) == 0);
  e[0] = 0.5;
  CHECK(leaf_of(tree, e) == 1);
  e[0] = 2.5;
  CHECK(leaf_of(tree, e) == 3);
  e[2] = 0.6;
  e[1] = -2.0;
  CHECK(leaf_of(tree, e) == 5);
  e[1] = 0.0;
  CHECK(leaf_of(tree, e) == 6);
  tree.leaf.fill(0.0F);
  tree.leaf[6] = 2.0F;
  std::array<Tree, 1> trees{tree};
  // One tree of the first cause. Its score is 2 against five times 0.
  const CauseProbabilities p = weigh({.base = {}, .trees = trees}, e);
  CHECK(p[0] == Approx(std::exp(2.0) / (std::exp(2.0) + 5.0)));
}

}  // namespace
}  // namespace loopwarden::tests::diagnosis_test
