// SPDX-License-Identifier: Apache-2.0
#include "model/twin/detectability.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "model/specialist/judge/limits.hpp"
#include "model/watch/loop_monitor.hpp"
#include "model/watch/specialist_judge.hpp"
#include "model/specialist/train/simulated_windows.hpp"

namespace loopwarden::twin {
namespace {

using alarm::AlarmKind;
using specialist::Condition;
using specialist::SimulatedWindow;
using specialist::WindowRequest;

constexpr std::array kSizes{0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 20.0};  // %
constexpr std::array kRates{5.0, 4.0, 3.0, 2.5, 2.0, 1.6, 1.3, 1.0, 0.8, 0.65, 0.5};    // %/s
static_assert(kSizes.size() == kRates.size());
constexpr double kRun_s = 7200.0;
constexpr double kYear_s = 365.25 * 86400.0;

WindowRequest request_of(Condition condition, std::size_t grade) {
  const bool air = condition == Condition::low_air_supply;
  return {.condition = condition,
          .moves = specialist::SetPointMoves::own,
          .severity_percent = condition == Condition::no_fault ? 0.0
                              : air                            ? kRates[grade]
                                                               : kSizes[grade]};
}

// A valve fault is there, whichever.
bool finds(const specialist::WindowVerdict& verdict) {
  double faults = 0.0;
  for (const Condition c : kWatched) faults += verdict.probabilities[static_cast<std::size_t>(c)];
  return faults >= specialist::JudgeLimits::kFault;
}

bool announces(const alarm::AlarmConditions& on, Condition condition) {
  const auto is = [&](AlarmKind kind) { return on[alarm::index_of(kind)].on; };
  switch (condition) {
    case Condition::stiction: return is(AlarmKind::stiction);
    case Condition::backlash:
    case Condition::hysteresis: return is(AlarmKind::backlash) || is(AlarmKind::hysteresis);
    case Condition::low_air_supply: return is(AlarmKind::low_air_supply);
    case Condition::no_fault:
    case Condition::other: break;
  }
  return std::any_of(on.begin(), on.end(), [](const auto& c) { return c.on; });
}

struct Watched {
  double first_s = std::numeric_limits<double>::infinity();
  std::size_t alarms = 0;  // that came
};

// Two hours of the loop through the daemon's monitor.
Watched watch(const plant::LoopModel& twin, const specialist::Team& team, Condition condition,
              std::size_t grade, std::uint64_t seed) {
  const auto samples = static_cast<std::size_t>(kRun_s / twin.sample_time_s);
  const SimulatedWindow run =
      specialist::simulate_run(twin, request_of(condition, grade), seed, samples);
  watch::SpecialistJudge judge(team);
  watch::LoopMonitor loop({.sample_time_s = twin.sample_time_s,
                           .pv_low = team.facts.pv_low,
                           .pv_high = team.facts.pv_high,
                           .co_low = team.facts.co_low,
                           .co_high = team.facts.co_high},
                          alarm::kAlarmRule, &judge);
  Watched out;
  bool on = false;
  for (std::size_t k = 0; k < run.pv.size(); ++k) {
    const watch::MonitorStep step = loop.add({.period_index = k,
                                              .sp = run.sp[k],
                                              .pv = run.pv[k],
                                              .co = run.co[k],
                                              .stem = std::nan(""),
                                              .automatic = true,
                                              .pv_good = true});
    if (step.kind != watch::MonitorStep::Kind::judged && !step.routine) continue;
    const bool now = announces(step.conditions, condition);
    if (now && !on) {
      ++out.alarms;
      out.first_s = std::min(out.first_s, static_cast<double>(k) * twin.sample_time_s);
    }
    on = now;
  }
  return out;
}

// Upper end of the 95 % interval (one-sided) of the mean of a Poisson count: P(count or fewer) =
// 0.05 there.
double most_expected(std::size_t count) {
  double low = 0.0;
  double high = 10.0 + 4.0 * static_cast<double>(count);
  for (int i = 0; i < 60; ++i) {
    const double mean = 0.5 * (low + high);
    double term = std::exp(-mean);
    double sum = term;
    for (std::size_t k = 1; k <= count; ++k) {
      term *= mean / static_cast<double>(k);
      sum += term;
    }
    (sum > 0.05 ? low : high) = mean;
  }
  return high;
}

// One window of a condition at a grade: found, and its size, % of span.
struct Tried {
  bool found = false;
  double size = 0.0;
};

class Looker {
 public:
  Looker(const plant::LoopModel& twin, const specialist::Team& team,
         const DetectabilitySettings& settings, const specialist::ParallelFor& parallel)
      : twin_(twin), team_(team), settings_(settings), parallel_(parallel) {}

  Seen look_for(Condition condition) const {
    Seen seen{.condition = condition, .percent_of_span = {}, .hours_to_alarm = {}};
    const std::optional<std::size_t> grade =
        condition == Condition::low_air_supply ? least_lacking(seen) : least_size(seen);
    if (grade) seen.hours_to_alarm = hours_to_alarm(condition, *grade);
    return seen;
  }

 private:
  std::vector<Tried> windows(Condition condition, std::size_t grade) const {
    std::vector<Tried> tried(settings_.windows);
    parallel_(settings_.windows, [&](std::size_t k) {
      const std::uint64_t place =
          (static_cast<std::uint64_t>(condition) * kSizes.size() + grade) * settings_.windows + k;
      const SimulatedWindow window = specialist::simulate_window(
          twin_, request_of(condition, grade), specialist::stream_seed(settings_.seed, place));
      specialist::TeamJudge judge(team_);
      tried[k] = {finds(judge.judge(window.view())), window.severity_percent};
    });
    return tried;
  }

  std::optional<std::size_t> least_size(Seen& seen) const {
    for (std::size_t grade = 0; grade < kSizes.size(); ++grade) {
      const std::vector<Tried> tried = windows(seen.condition, grade);
      const auto found =
          std::count_if(tried.begin(), tried.end(), [](const Tried& t) { return t.found; });
      const double share = static_cast<double>(found) / static_cast<double>(tried.size());
      seen.found_at_most = std::max(seen.found_at_most, share);
      if (share < kFound) continue;
      seen.percent_of_span = kSizes[grade];
      return grade;
    }
    return std::nullopt;
  }

  // What the stem lacked follows from the run: windows of all rates, from the largest lack down as
  // long as they are found.
  std::optional<std::size_t> least_lacking(Seen& seen) const {
    constexpr std::size_t kFewest = 20;
    std::vector<Tried> all;
    std::vector<double> typical(kRates.size());
    for (std::size_t grade = 0; grade < kRates.size(); ++grade) {
      const std::vector<Tried> tried = windows(seen.condition, grade);
      std::vector<double> sizes;
      for (const Tried& t : tried) sizes.push_back(t.size);
      std::sort(sizes.begin(), sizes.end());
      typical[grade] = sizes[sizes.size() / 2];
      all.insert(all.end(), tried.begin(), tried.end());
    }
    std::stable_sort(all.begin(), all.end(),
                     [](const Tried& a, const Tried& b) { return a.size > b.size; });
    std::size_t found = 0;
    for (std::size_t n = 1; n <= all.size(); ++n) {
      if (all[n - 1].found) ++found;
      if (n < kFewest) continue;
      const double share = static_cast<double>(found) / static_cast<double>(n);
      seen.found_at_most = std::max(seen.found_at_most, share);
      if (share >= kFound) seen.percent_of_span = all[n - 1].size;
    }
    if (!seen.percent_of_span) return std::nullopt;
    for (std::size_t grade = 0; grade < kRates.size(); ++grade) {
      if (typical[grade] >= *seen.percent_of_span) return grade;
    }
    return kRates.size() - 1;
  }

  std::optional<double> hours_to_alarm(Condition condition, std::size_t grade) const {
    std::vector<double> first_s(settings_.alarm_runs);
    parallel_(settings_.alarm_runs, [&](std::size_t k) {
      const std::uint64_t place = static_cast<std::uint64_t>(condition) * settings_.alarm_runs + k;
      first_s[k] =
          watch(twin_, team_, condition, grade, specialist::stream_seed(settings_.seed + 1, place))
              .first_s;
    });
    std::sort(first_s.begin(), first_s.end());
    const double median_s = first_s[first_s.size() / 2];
    if (!std::isfinite(median_s)) return std::nullopt;
    return median_s / 3600.0;
  }

  const plant::LoopModel& twin_;
  const specialist::Team& team_;
  const DetectabilitySettings& settings_;
  const specialist::ParallelFor& parallel_;
};

}  // namespace

Detectability look(const plant::LoopModel& twin, const specialist::Team& team,
                   const DetectabilitySettings& settings, const specialist::ParallelFor& parallel,
                   const std::function<void(double)>& progress) {
  Detectability out;
  const Looker looker(twin, team, settings, parallel);
  const double all = static_cast<double>(kWatched.size() + 1);
  for (std::size_t c = 0; c < kWatched.size(); ++c) {
    out.seen[c] = looker.look_for(kWatched[c]);
    progress(static_cast<double>(c + 1) / all);
  }
  std::vector<std::size_t> alarms(settings.healthy_runs);
  parallel(settings.healthy_runs, [&](std::size_t k) {
    alarms[k] =
        watch(twin, team, Condition::no_fault, 0, specialist::stream_seed(settings.seed + 2, k))
            .alarms;
  });
  for (const std::size_t n : alarms) out.false_alarms += n;
  out.simulated_years = static_cast<double>(settings.healthy_runs) * kRun_s / kYear_s;
  out.false_alarms_per_year = most_expected(out.false_alarms) / out.simulated_years;
  progress(1.0);
  return out;
}

}  // namespace loopwarden::twin
