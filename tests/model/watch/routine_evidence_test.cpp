// SPDX-License-Identifier: Apache-2.0
// Measures the rule of routine evidence on simulated loops: sticking ones raise their alarm after
// two full windows when diagnose() sees stiction in the same samples, and healthy ones raise no
// alarm.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "model/watch/routine_watch.hpp"
#include "model/numeric/random.hpp"
#include "model/effects/stiction/stiction_karnopp.hpp"
#include "model/watch/limits.hpp"
#include "tests/model/diagnosis/signals.hpp"

namespace loopwarden::tests::routine_evidence_test {
namespace {

using namespace loopwarden;
using namespace loopwarden::alarm;
using namespace loopwarden::watch;

constexpr double kSetPoint = 20.0;  // in the form of SmallLoop
constexpr std::size_t kWindows = 4;
constexpr std::size_t kLoops = 16;

// A load with a correlation time of 40 s.
std::function<double(double)> random_load(double deviation, std::uint64_t seed) {
  constexpr double kKept = 0.975;
  return [=, load = 0.0, random = numeric::Random(seed)](double) mutable {
    load = kKept * load + deviation * std::sqrt(1.0 - kKept * kKept) * random.normal();
    return load;
  };
}

// A flow loop with the tuning of a rule, all drawn at random.
SmallLoop flow_loop(std::uint64_t seed) {
  numeric::Random random(seed);
  SmallLoop loop{.sample_time_s = 1.0, .seed = seed};
  loop.time_constant = random.uniform(3.0, 10.0);
  loop.dead_samples = 1 + static_cast<std::size_t>(random.uniform(0.0, 3.0));
  const double dead_time = static_cast<double>(loop.dead_samples);
  const double lambda = random.uniform(1.0, 3.0) * std::max(0.5 * loop.time_constant, dead_time);
  loop.gain = loop.time_constant / (lambda + dead_time);
  loop.integral_time = loop.time_constant;
  loop.noise = random.uniform(0.05, 0.3);
  return loop;
}

struct Raised {
  std::size_t window = 0;  // in which the condition was raised, from 1; 0: it was not
  std::size_t seen_in =
      0;  // in which diagnose() first saw stiction in it and the one before as one record
};

// Returns whether diagnose() sees stiction in the two windows up to `end`.
bool stiction_is_seen(const SmallLoop::Run& run, std::size_t end) {
  constexpr std::size_t kBoth = 2 * watch::WatchLimits::kRoutineSamples;
  const std::span<const double> pv(run.pv);
  const std::span<const double> co(run.co);
  const RoutineWatch::Judgement both =
      judge_routine({.pv = pv.subspan(end - kBoth, kBoth), .co = co.subspan(end - kBoth, kBoth)});
  return both.verdict == diagnosis::DiagnosisVerdict::valve_effect &&
         both.fault == AlarmKind::stiction && both.grade == diagnosis::Grade::seen;
}

Raised watch(const SmallLoop::Run& run) {
  RoutineWatch routine({.sample_time_s = 1.0});
  Raised found;
  std::size_t window = 0;
  for (std::size_t k = 0; k < run.pv.size(); ++k) {
    const Cycle cycle{.period_index = k,
                      .sp = kSetPoint,
                      .pv = run.pv[k],
                      .co = run.co[k],
                      .stem = std::nan(""),
                      .automatic = true,
                      .pv_good = true};
    if (!routine.add(cycle) || (k + 1) % watch::WatchLimits::kRoutineSamples != 0) continue;
    ++window;
    if (window > 1 && found.seen_in == 0 && stiction_is_seen(run, k + 1)) found.seen_in = window;
    bool on = false;
    for (const AlarmCondition& condition : routine.conditions()) on = on || condition.on;
    if (on && found.window == 0) found.window = window;
  }
  return found;
}

std::size_t raised_within(std::size_t windows, const std::vector<Raised>& all) {
  return static_cast<std::size_t>(std::count_if(all.begin(), all.end(), [&](const Raised& one) {
    return one.window > 0 && one.window <= windows;
  }));
}

std::vector<Raised> sticking(double s, double j) {
  std::vector<Raised> all;
  for (std::uint64_t seed = 1; seed <= kLoops; ++seed) {
    effects::StictionKarnopp valve({.s = s, .j = j}, 0.5);
    valve.reset(50.0);
    numeric::Random random(seed + 500);
    const double load = 0.1 + 0.5 * random.uniform();
    all.push_back(watch(flow_loop(seed).run(
        kWindows * watch::WatchLimits::kRoutineSamples, [&](double u) { return valve.step(u); },
        random_load(load, seed))));
  }
  return all;
}

std::vector<Raised> healthy(
    const std::function<SmallLoop(std::uint64_t)>& loop,
    const std::function<std::function<double(double)>(std::uint64_t)>& load) {
  std::vector<Raised> all;
  for (std::uint64_t seed = 1; seed <= kLoops; ++seed) {
    all.push_back(watch(loop(seed).run(
        kWindows * watch::WatchLimits::kRoutineSamples, [](double u) { return u; }, load(seed))));
  }
  return all;
}

}  // namespace

TEST_CASE("a sticking valve raises its alarm after two full windows if both as one record show it",
          "[routine]") {
  for (const auto& [s, j] : {std::pair(8.0, 1.0), std::pair(5.0, 2.0)}) {
    INFO("s " << s << " j " << j);
    const std::vector<Raised> all = sticking(s, j);
    for (const Raised& one : all) {
      if (one.seen_in > 0) CHECK((one.window > 0 && one.window <= one.seen_in));
    }
    CHECK(raised_within(2, all) >= kLoops / 3);
    CHECK(raised_within(kWindows, all) >= 3 * kLoops / 4);
  }
}

TEST_CASE("a healthy loop raises no alarm from two windows as one record", "[routine]") {
  const auto disturbed = [](std::uint64_t seed) { return random_load(0.8, seed); };
  CHECK(raised_within(kWindows, healthy(flow_loop, disturbed)) == 0);

  const auto ringing = [](std::uint64_t seed) {
    SmallLoop loop = flow_loop(seed);
    loop.gain *= 1.8;
    return loop;
  };
  CHECK(raised_within(kWindows, healthy(ringing, disturbed)) == 0);

  const auto slow = [](std::uint64_t seed) {
    SmallLoop loop = flow_loop(seed);
    loop.time_constant *= 15.0;
    loop.dead_samples *= 8;
    loop.integral_time = loop.time_constant;
    return loop;
  };
  CHECK(raised_within(kWindows, healthy(slow, disturbed)) == 0);

  const auto swung = [](std::uint64_t seed) {
    return [=, other = random_load(0.2, seed)](double t) mutable {
      return 2.0 * sine(t / (20.0 + 8.0 * static_cast<double>(seed))) + other(t);
    };
  };
  CHECK(raised_within(2, healthy(flow_loop, swung)) == 0);
}

}  // namespace loopwarden::tests::routine_evidence_test
