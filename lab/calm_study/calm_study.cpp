// SPDX-License-Identifier: Apache-2.0
#include "lab/calm_study/calm_study.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "base/parallel.hpp"
#include "model/numeric/draw.hpp"
#include "model/numeric/random.hpp"
#include "lab/calm_study/calm_commission.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::lab {
namespace {

using control::CompensatorKind;
using control::JacketForm;
using numeric::log_uniform;
using numeric::Random;

constexpr double kOutputSpan = 10.0;                  // CO units (V) of all loops in this study
constexpr double kResolution = kOutputSpan / 4096.0;  // 12 bit
constexpr double kSamplePeriod = 0.1;                 // s
constexpr double kNoticeable = 0.05;                  // relative change that counts as a change
constexpr double kNoticeablePercent = 0.02;           // rise on a healthy loop, of the PV span
constexpr std::array kFrictionLaws{"choudhury", "he", "karnopp"};

// Lambda tuning with the factor 1 to 4 on the larger of lag and dead time, or Ziegler and Nichols'
// reaction curve with both gains divided by 1.5 to 2.
control::PidGains random_tuning(Random& random, const plant::ProcessParameters& p) {
  if (random.uniform() < 0.5) {
    const double lambda = random.uniform(1.0, 4.0) * std::max(p.time_constant_s, p.dead_time_s);
    const double kp = p.time_constant_s / (p.gain * (lambda + p.dead_time_s));
    return {.kp = kp, .ki = kp / p.time_constant_s};
  }
  const double divisor = random.uniform(1.5, 2.0);
  const double kp = 0.9 * p.time_constant_s / (p.gain * p.dead_time_s) / divisor;
  return {.kp = kp, .ki = kp / (3.33 * p.dead_time_s)};
}

// Moves of 2 to 20 % of the span within 20 to 80 %.
std::vector<std::pair<double, double>> random_set_points(Random& random, double pv_span) {
  constexpr int kSetPoints = 7;  // the first to get to know the loop
  std::vector<std::pair<double, double>> profile;
  double share = random.uniform(0.3, 0.7);
  for (int i = 0; i < kSetPoints; ++i) {
    profile.emplace_back(0.0, share * pv_span);
    double move = random.uniform(0.02, 0.2) * (random.uniform() < 0.5 ? -1.0 : 1.0);
    if (share + move < 0.2 || share + move > 0.8) move = -move;
    share += move;
  }
  return profile;
}

CalmTrial random_loop(Random& random) {
  CalmTrial trial;
  trial.unmeasured = 1;
  plant::LoopModel& model = trial.model;
  const double gain = random.uniform(0.5, 2.0);
  const double pv_span = kOutputSpan * gain;
  model.sample_time_s = kSamplePeriod;
  model.transmitter = {.low = 0.0,
                       .high = pv_span,
                       .resolution = pv_span / 4096.0,
                       .noise = random.uniform(0.0, 0.002) * pv_span};
  control::ControllerSettings& controller = model.controller;
  controller.pid.output_high = kOutputSpan;
  controller.output.high = kOutputSpan;
  controller.set_point.high = pv_span;
  trial.output_resolution = kResolution;
  trial.read_back.resolution = kResolution;
  plant::ProcessParameters& process = model.process;
  process.gain = gain;
  process.time_constant_s = log_uniform(random, 1.0, 10.0);
  process.dead_time_s = process.time_constant_s * random.uniform(0.2, 2.0);
  controller.pid.gains = random_tuning(random, process);
  return trial;
}

void give_read_back_errors(CalmTrial& trial, Random& random) {
  trial.read_back.bias = kOutputSpan * random.uniform(-0.002, 0.002);
  trial.read_back.noise = kOutputSpan * random.uniform(0.0, 0.0005);
}

void give_set_points_and_noise(CalmTrial& trial, Random& random) {
  trial.model.scenario.set_point = random_set_points(random, trial.model.transmitter.high);
  trial.model.scenario.seed = random.bits();
}

Random stream(std::uint64_t seed, std::size_t index) {
  return Random(seed * 0x9e3779b97f4a7c15ULL + index);
}

double ratio(double value, double base) {
  return base > 0.0 ? value / base : value > 0.0 ? 1e9 : 1.0;
}

double share_of(const std::vector<double>& values, const std::function<bool(double)>& counts) {
  return static_cast<double>(std::count_if(values.begin(), values.end(), counts)) /
         static_cast<double>(values.size());
}

// ---- compensators under test

struct ToldWrong {
  double valve = 0.0;  // s and j, each wrong by up to this share
  double model = 0.0;  // gain, lag and dead time
};

void fit_planned_moves(const StickyLoop& loop, Random& random, CalmTrial& trial, bool read_back,
                       ToldWrong wrong) {
  const auto off_by = [&](double share) { return random.uniform(1.0 - share, 1.0 + share); };
  const plant::ProcessParameters& process = trial.model.process;
  const double s = loop.s * off_by(wrong.valve);
  const double j = std::min(s, loop.j * off_by(wrong.valve));
  trial.model.controller.compensator = {
      .kind = CompensatorKind::planned_moves,
      .planned = {.gain = process.gain * off_by(wrong.model),
                  .time_constant_s = process.time_constant_s * off_by(wrong.model),
                  .dead_time_s = process.dead_time_s * off_by(wrong.model),
                  .actuator_lag_s = !read_back && trial.physical ? trial.physical->air_lag_s : 0.0,
                  .load = loop.load * log_uniform(random, 0.7, 1.4),
                  .s = s,
                  .j = j,
                  .s_low = s / (1.0 + wrong.valve),
                  .s_high = s / (1.0 - wrong.valve),
                  .j_low = j / (1.0 + wrong.valve),
                  .j_high = j / (1.0 - wrong.valve),
                  .read_back = read_back}};
}

Contestant planned_moves(const char* name, bool read_back, ToldWrong wrong) {
  return {name, [=](const StickyLoop& loop, Random& random, CalmTrial& trial) {
            fit_planned_moves(loop, random, trial, read_back, wrong);
            return true;
          }};
}

Contestant jacket(const char* name, JacketForm form) {
  return {name, [=](const StickyLoop&, Random&, CalmTrial& trial) {
            trial.model.controller.jacket = {
                .form = form, .gain_per_s = 1.0, .dead_zone = 0.003 * kOutputSpan};
            return true;
          }};
}

Contestant adding(const char* name,
                  std::function<control::CompensatorSettings(const StickyLoop&)> settings) {
  return {name,
          [settings = std::move(settings)](const StickyLoop& loop, Random&, CalmTrial& trial) {
            trial.model.controller.compensator = settings(loop);
            return true;
          }};
}

// Uses process, load, s and j as identified by the project.
bool fit_found_out(const StickyLoop& loop, Random& random, CalmTrial& trial) {
  const std::optional<control::PlannedMovesSettings> found = found_out(loop, random);
  if (found) {
    trial.model.controller.compensator = {.kind = CompensatorKind::planned_moves,
                                          .planned = *found};
  }
  return found.has_value();
}

}  // namespace

std::vector<Contestant> contestants() {
  return {
      jacket("jacket: paper", JacketForm::paper),
      jacket("jacket: bounded", JacketForm::bounded),
      jacket("jacket: dwell", JacketForm::dwell),
      adding("two_move",
             [](const StickyLoop& loop) {
               const double answer = plant::answer_s(loop.trial.model);
               return control::CompensatorSettings{
                   .kind = CompensatorKind::two_move,
                   .stick_band = loop.s,
                   .move_time_s = answer,
                   .max_mean_error = loop.trial.model.process.gain * loop.s,
                   .mean_error_time_s = 20.0 * answer};
             }),
      adding("reinforcement",
             [](const StickyLoop& loop) {
               const plant::LoopModel& model = loop.trial.model;
               return control::CompensatorSettings{
                   .kind = CompensatorKind::reinforcement,
                   .amplitude = 0.4 * loop.s,
                   .noise_band = 4.0 * model.transmitter.noise * model.controller.pid.gains.kp};
             }),
      planned_moves("planned_moves", true, {}),
      planned_moves("planned_moves, s and j off by 30 %", true, {.valve = 0.3}),
      planned_moves("planned_moves, model off by 15 % as well", true,
                    {.valve = 0.3, .model = 0.15}),
      planned_moves("planned_moves without read-back", false, {}),
      planned_moves("planned_moves without read-back, all off", false,
                    {.valve = 0.3, .model = 0.15}),
      {.name = "commissioned, explained, planned_moves", .fit = fit_found_out, .costly = true},
  };
}

StickyLoop random_sticky_loop(std::uint64_t seed, std::size_t index, Load load, Valve valve) {
  Random random = stream(seed, index);
  StickyLoop loop;
  loop.trial = random_loop(random);
  CalmTrial& trial = loop.trial;
  loop.s = kOutputSpan * log_uniform(random, 0.01, 0.15);
  loop.j = loop.s * random.uniform(0.1, 1.0);
  loop.law = kFrictionLaws[static_cast<std::size_t>(random.uniform() *
                                                    static_cast<double>(kFrictionLaws.size()))];
  trial.model.valve_effects = {{.name = "stiction",
                                .parameters = {{"s", loop.s}, {"j", loop.j}},
                                .options = {{"law", loop.law}}}};
  give_read_back_errors(trial, random);
  const double intensity = log_uniform(random, 0.0001, 0.001) * trial.model.transmitter.high;
  if (load == Load::wandering) {
    loop.load = intensity;  // standard deviation: intensity sqrt(time constant / 2)
    trial.model.disturbances = {
        {.name = "random_load",
         .parameters = {{"intensity", intensity}, {"time_constant", 300.0}}}};
  }
  // About 18 periods of the limit cycle at each set point; the first third is left out.
  const plant::ProcessParameters& process = trial.model.process;
  const double between_slips_s =
      2.0 * loop.s / (trial.model.controller.pid.gains.ki * process.gain * loop.j);
  const double period_s =
      2.0 * between_slips_s + 4.0 * (process.time_constant_s + process.dead_time_s);
  trial.hold_s = std::clamp(18.0 * period_s, 900.0, 9000.0);
  trial.settling_s = trial.hold_s / 3.0;
  give_set_points_and_noise(trial, random);
  if (valve == Valve::physical) {
    trial.physical = random_physical_valve(random, loop.s, loop.j);
    loop.law = std::array{"karnopp", "stribeck",
                          "lugre"}[static_cast<std::size_t>(trial.physical->friction)];
    trial.model.valve_effects.clear();
  }
  return loop;
}

CalmTrial random_healthy_loop(std::uint64_t seed, std::size_t index) {
  Random random = stream(~seed, index);
  CalmTrial trial = random_loop(random);
  trial.model.valve_effects = {
      {.name = "positioner_lag", .parameters = {{"time_constant", random.uniform(0.0, 2.0)}}}};
  if (random.uniform() < 0.5) {
    const double intensity = log_uniform(random, 0.0001, 0.001) * trial.model.transmitter.high;
    trial.model.disturbances = {
        {.name = "random_load",
         .parameters = {{"intensity", intensity}, {"time_constant", 300.0}}}};
  }
  const plant::ProcessParameters& process = trial.model.process;
  trial.hold_s = std::clamp(40.0 * (process.time_constant_s + process.dead_time_s), 300.0, 2000.0);
  trial.settling_s = trial.hold_s / 3.0;
  give_read_back_errors(trial, random);
  give_set_points_and_noise(trial, random);
  return trial;
}

Spread spread_of(const std::vector<double>& values) {
  return {.tenth = numeric::quantile(values, 0.1),
          .median = numeric::median(values),
          .ninetieth = numeric::quantile(values, 0.9),
          .worst = numeric::quantile(values, 1.0)};
}

StickyStudy study_sticky_loops(std::size_t cases, std::uint64_t seed, Load load,
                               const std::string& only, const StudyWork& work, Valve valve) {
  std::vector<Contestant> all = contestants();
  std::erase_if(all, [&](const Contestant& one) {
    // The identification needs records of the friction laws.
    const bool left_out = one.costly && (only.empty() || valve == Valve::physical);
    return !one.name.starts_with(only) || left_out;
  });
  struct Case {
    TrialResult without;
    std::vector<TrialResult> with;
    std::vector<bool> offered;
  };
  std::vector<Case> tried(cases);
  const auto run = [&](std::size_t i) {
    const StickyLoop loop = random_sticky_loop(seed, i, load, valve);
    tried[i].without = run_trial(loop.trial);
    for (const Contestant& one : all) {
      CalmTrial trial = loop.trial;
      Random random = stream(seed ^ 0x5bd1e995ULL, i);
      tried[i].offered.push_back(one.fit(loop, random, trial));
      tried[i].with.push_back(run_trial(trial));
    }
  };
  const auto progress = [&](std::size_t done) {
    if (work.progress) work.progress(done, cases);
  };
  base::parallel_for(cases, work.threads, run, progress);

  StickyStudy study;
  study.load = load;
  if (cases == 0) return study;
  for (std::size_t c = 0; c < all.size(); ++c) {
    StickyRow row;
    row.name = all[c].name;
    std::vector<double> whole;
    std::vector<double> travel;
    for (const Case& one : tried) {
      if (!one.offered[c]) continue;
      row.factors.push_back(ratio(one.with[c].settled.rms_error, one.without.settled.rms_error));
      whole.push_back(ratio(one.with[c].whole_rms_error, one.without.whole_rms_error));
      travel.push_back(
          ratio(one.with[c].settled.travel_per_hour, one.without.settled.travel_per_hour));
    }
    row.share_offered = static_cast<double>(row.factors.size()) / static_cast<double>(cases);
    if (row.factors.empty()) {
      study.rows.push_back(std::move(row));
      continue;
    }
    row.share_falls = share_of(row.factors, [](double factor) { return factor < 1.0; });
    row.share_rises_5 =
        share_of(row.factors, [](double factor) { return factor > 1.0 + kNoticeable; });
    row.rms_factor = spread_of(row.factors);
    row.whole_rms_factor = numeric::median(whole);
    row.travel_factor = numeric::median(travel);
    row.share_travel = share_of(travel, [](double factor) { return factor > 1.0; });
    study.rows.push_back(std::move(row));
  }
  return study;
}

const char* to_text(Trouble::Kind kind) {
  constexpr std::array kNames{"none",
                              "read-back stuck",
                              "read-back off by 2 %",
                              "read-back lost",
                              "read-back 5 s late",
                              "PV frozen for a minute",
                              "output lost for a minute",
                              "reload",
                              "valve repaired"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::vector<TroubleRow> study_troubles(std::size_t cases, std::uint64_t seed,
                                       const StudyWork& work) {
  constexpr auto kKinds = static_cast<std::size_t>(Trouble::Kind::repaired);
  constexpr double kWorse = 0.3;  // relative; smaller changes may be due to the phase of the cycle
  struct Outcome {
    double factor = 1.0;
    bool worse = false;
  };
  std::vector<Outcome> outcomes(cases * kKinds);
  const auto run = [&](std::size_t i) {
    StickyLoop loop = random_sticky_loop(seed, i % cases, Load::wandering);
    CalmTrial& trial = loop.trial;
    trial.unmeasured = 4;
    trial.trouble = {.kind = static_cast<Trouble::Kind>(1 + i / cases),
                     .from_s = 3.5 * trial.hold_s};
    if (trial.trouble.kind == Trouble::Kind::repaired) {
      trial.model.scenario.faults = {{.effect = trial.model.valve_effects.front(),
                                      .block = effects::Block::valve,
                                      .schedule = {.to_s = trial.trouble.from_s}}};
      trial.model.valve_effects.clear();
    }
    const double without = run_trial(trial).settled.rms_error;
    Random random = stream(seed ^ 0x5bd1e995ULL, i % cases);
    CalmTrial calmed = trial;
    fit_planned_moves(loop, random, calmed, true, {});
    const double with = run_trial(calmed).settled.rms_error;
    const double noticeable = kNoticeablePercent / 100.0 * trial.model.transmitter.high;
    outcomes[i] = {.factor = ratio(with, without),
                   .worse = with > (1.0 + kWorse) * without && with > without + noticeable};
  };
  const auto progress = [&](std::size_t done) {
    if (work.progress) work.progress(done, outcomes.size());
  };
  base::parallel_for(outcomes.size(), work.threads, run, progress);
  std::vector<TroubleRow> rows;
  for (std::size_t k = 0; cases > 0 && k < kKinds; ++k) {
    TroubleRow row{.kind = static_cast<Trouble::Kind>(1 + k)};
    for (std::size_t i = k * cases; i < (k + 1) * cases; ++i) {
      row.share_worse += outcomes[i].worse ? 1.0 / static_cast<double>(cases) : 0.0;
      row.worst = std::max(row.worst, outcomes[i].factor);
    }
    rows.push_back(row);
  }
  return rows;
}

std::vector<RateRow> study_rate_limits(std::size_t cases, std::uint64_t seed,
                                       const StudyWork& work) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  std::vector<RateRow> rows;
  for (const double rate : {0.2, 0.5, 1.0, 5.0, kNone}) rows.push_back({.percent_per_s = rate});
  for (const double rate : {1.0, kNone}) {
    rows.push_back({.percent_per_s = rate, .read_back_s = 2.0});
  }
  for (RateRow& row : rows) {
    row.factors.resize(cases);
    row.luck.resize(cases);
  }
  const auto run = [&](std::size_t i) {
    RateRow& row = rows[i / cases];
    const std::size_t n = i % cases;
    const StickyLoop loop =
        random_sticky_loop(seed, n, n % 2 == 0 ? Load::steady : Load::wandering);
    CalmTrial trial = loop.trial;
    trial.model.controller.output.rate_per_s = 0.01 * row.percent_per_s * kOutputSpan;
    trial.read_back.renewed_s = row.read_back_s;
    CalmTrial calmed = trial;
    Random random = stream(seed ^ 0x5bd1e995ULL, n);
    fit_planned_moves(loop, random, calmed, true, {.valve = 0.3, .model = 0.15});
    control::PlannedMovesSettings& moves = calmed.model.controller.compensator.planned;
    moves.max_move = 0.1 * kOutputSpan;
    moves.max_moves_per_hour = 60.0;
    const auto squares = [&](CalmTrial one, std::uint64_t first) {
      double sum = 0.0;
      for (int k = 0; k < kRateRepeats; ++k) {
        one.model.scenario.seed = first + static_cast<std::uint64_t>(k);
        const double rms = run_trial(one).whole_rms_error;
        sum += rms * rms;
      }
      return sum;
    };
    const std::uint64_t noise = trial.model.scenario.seed;
    const double without = squares(trial, noise);
    row.factors[n] = std::sqrt(ratio(squares(calmed, noise), without));
    row.luck[n] = std::sqrt(ratio(squares(trial, noise + kRateRepeats), without));
  };
  const auto progress = [&](std::size_t done) {
    if (work.progress) work.progress(done, rows.size() * cases);
  };
  base::parallel_for(rows.size() * cases, work.threads, run, progress);
  return rows;
}

HealthyStudy study_healthy_loops(std::size_t cases, std::uint64_t seed, const StudyWork& work) {
  std::vector<double> rises(cases);
  const auto run = [&](std::size_t i) {
    CalmTrial trial = random_healthy_loop(seed, i);
    Random random = stream(seed ^ 0x5bd1e995ULL, i);
    StickyLoop believed;
    believed.s = kOutputSpan * log_uniform(random, 0.01, 0.15);
    believed.j = believed.s * random.uniform(0.1, 1.0);
    believed.load = 3e-4 * trial.model.transmitter.high;
    const double without = run_trial(trial).settled.rms_error;
    fit_planned_moves(believed, random, trial, true, {});
    rises[i] =
        100.0 * (run_trial(trial).settled.rms_error - without) / trial.model.transmitter.high;
  };
  const auto progress = [&](std::size_t done) {
    if (work.progress) work.progress(done, cases);
  };
  base::parallel_for(cases, work.threads, run, progress);
  return {.share_rises = share_of(rises, [](double rise) { return rise > kNoticeablePercent; }),
          .worst_rise_percent = spread_of(rises).worst};
}

}  // namespace loopwarden::lab
