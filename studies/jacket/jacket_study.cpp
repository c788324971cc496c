// SPDX-License-Identifier: Apache-2.0
#include "studies/jacket/jacket_study.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/numeric/draw.hpp"
#include "model/numeric/random.hpp"
#include "model/numeric/statistics.hpp"
#include "base/parallel.hpp"

namespace loopwarden::studies {
namespace {

using control::JacketForm;
using numeric::log_uniform;
using numeric::Random;

constexpr double kOutputSpan = 10.0;                  // CO units (V) of every loop here
constexpr double kResolution = kOutputSpan / 4096.0;  // 12 bit
constexpr double kDeadZone = 0.003 * kOutputSpan;     // CO units
constexpr double kSamplePeriod = 0.1;                 // s
constexpr double kNoticeable = 0.05;                  // change that counts, relative
constexpr double kNoticeablePercent = 0.02;           // rise on a healthy loop, of the PV span
constexpr std::array kLaws{"choudhury", "he", "karnopp"};
constexpr std::array kGains{0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 5.0};  // Ks, 1/s

control::JacketSettings jacket(JacketForm form, double gain_per_s) {
  return {.form = form, .gain_per_s = gain_per_s, .dead_zone = kDeadZone};
}

TrialResult run_with(JacketTrial trial, JacketForm form, double gain_per_s) {
  trial.model.controller.jacket = jacket(form, gain_per_s);
  return run_trial(trial);
}

plant::EffectSpec stiction(const char* law, double s, double j) {
  plant::EffectSpec effect;
  effect.name = "stiction";
  effect.parameters = {{"s", s}, {"j", j}};
  effect.options = {{"law", law}};
  return effect;
}

// Standard deviation: intensity sqrt(time constant / 2).
plant::EffectSpec random_load(double intensity) {
  plant::EffectSpec effect;
  effect.name = "random_load";
  effect.parameters = {{"intensity", intensity}, {"time_constant", 300.0}};
  return effect;
}

plant::EffectSpec positioner_lag(double seconds) {
  plant::EffectSpec effect;
  effect.name = "positioner_lag";
  effect.parameters = {{"time_constant", seconds}};
  return effect;
}

// Everything but gains, process and set points.
JacketTrial bare_trial(double process_gain, double noise_share) {
  JacketTrial trial;
  const double pv_span = kOutputSpan * process_gain;
  plant::LoopModel& model = trial.model;
  model.sample_time_s = kSamplePeriod;
  model.process.gain = process_gain;
  model.transmitter = {
      .low = 0.0, .high = pv_span, .resolution = pv_span / 4096.0, .noise = noise_share * pv_span};
  control::ControllerSettings& controller = model.controller;
  controller.pid.output_high = kOutputSpan;
  controller.output.high = kOutputSpan;
  controller.set_point.high = pv_span;
  trial.output_resolution = kResolution;
  trial.read_back.resolution = kResolution;
  return trial;
}

// ---- plant 1

JacketTrial plant1_trial(const char* law, double s, double j, std::uint64_t seed) {
  JacketTrial trial = bare_trial(1.2264, 0.0);
  plant::LoopModel& model = trial.model;
  model.process = {.gain = 1.2264, .time_constant_s = 1.69376, .dead_time_s = 2.6256};
  model.transmitter = {.low = 0.0, .high = 10.0, .resolution = 10.0 / 4096.0, .noise = 0.01};
  model.controller.set_point.high = 10.0;
  model.controller.pid.gains = {.kp = 0.61145 / 1.75, .ki = 0.070013 / 1.75};
  model.valve_effects = {stiction(law, s, j)};
  model.scenario.seed = seed;
  for (const double set_point : {5.0, 5.6, 4.7, 6.1, 5.3, 4.1, 6.4, 5.8}) {  // L/min
    model.scenario.set_point.emplace_back(0.0, set_point);
  }
  return trial;
}

std::vector<Plant1Row> plant1_rows() {
  constexpr std::array<std::pair<double, double>, 3> kSizes{{{0.5, 0.2}, {1.0, 0.5}, {1.5, 1.2}}};
  std::vector<Plant1Row> rows;
  for (const char* law : kLaws) {
    for (const auto& [s, j] : kSizes) {
      const auto add = [&, s = s, j = j](JacketForm form, double gain_per_s) {
        rows.push_back({law, s, j, form, gain_per_s, {}});
      };
      add(JacketForm::off, 0.0);
      for (const JacketForm form : {JacketForm::paper, JacketForm::bounded}) {
        for (const double gain_per_s : {0.01, 0.05, 0.2, 1.0, 5.0}) add(form, gain_per_s);
      }
      add(JacketForm::dwell, 0.0);
    }
  }
  return rows;
}

// ---- random loops

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
  constexpr int kSetPoints = 6;
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

JacketTrial random_loop(Random& random) {
  JacketTrial trial = bare_trial(random.uniform(0.5, 2.0), random.uniform(0.0, 0.002));
  plant::ProcessParameters& process = trial.model.process;
  process.time_constant_s = log_uniform(random, 1.0, 10.0);
  process.dead_time_s = process.time_constant_s * random.uniform(0.2, 2.0);
  trial.model.controller.pid.gains = random_tuning(random, process);
  return trial;
}

void give_set_points_and_noise(JacketTrial& trial, Random& random) {
  trial.model.scenario.set_point = random_set_points(random, trial.model.transmitter.high);
  trial.model.scenario.seed = random.bits();
}

Random stream(std::uint64_t seed, std::size_t index) {
  return Random(seed * 0x9e3779b97f4a7c15ULL + index);
}

double ratio(double value, double base) {
  return base > 0.0 ? value / base : value > 0.0 ? 1e9 : 1.0;
}

// ---- sticky loops

constexpr std::array kBoundable{JacketForm::paper, JacketForm::bounded};  // forms that have a Ks

struct Tried {
  double gain_per_s = 0.0;
  TrialResult result;
};

// Per case: off, then the variants in the order of variant_names().
struct StickyCase {
  TrialResult off;
  std::vector<Tried> variants;
};

std::vector<std::string> variant_names() {
  return {"paper, Ks = 1", "paper, best Ks", "bounded, Ks = 1", "bounded, best Ks", "dwell"};
}

double best_gain(const JacketTrial& trial, JacketForm form) {
  double best = kGains.front();
  double least = -1.0;
  for (const double gain_per_s : kGains) {
    const double rms = run_with(trial, form, gain_per_s).settled.rms_error;
    if (least < 0.0 || rms < least) {
      least = rms;
      best = gain_per_s;
    }
  }
  return best;
}

StickyCase try_case(const RandomLoop& loop) {
  StickyCase tried;
  tried.off = run_with(loop.reported, JacketForm::off, 0.0);
  const auto add = [&](JacketForm form, double gain_per_s) {
    tried.variants.push_back({gain_per_s, run_with(loop.reported, form, gain_per_s)});
  };
  for (const JacketForm form : kBoundable) {
    add(form, 1.0);
    add(form, best_gain(loop.chosen, form));
  }
  add(JacketForm::dwell, 0.0);
  return tried;
}

double share_of(const std::vector<double>& values, const std::function<bool(double)>& counts) {
  return static_cast<double>(std::count_if(values.begin(), values.end(), counts)) /
         static_cast<double>(values.size());
}

StickyRow summarise(const std::string& name, const std::vector<StickyCase>& cases,
                    std::size_t variant) {
  std::vector<double> rms, whole, mean, travel, reversals, parked, gain;
  for (const StickyCase& one : cases) {
    const Tried& tried = one.variants[variant];
    const analysis::LoopMetrics& with = tried.result.settled;
    const analysis::LoopMetrics& without = one.off.settled;
    rms.push_back(ratio(with.rms_error, without.rms_error));
    whole.push_back(ratio(tried.result.whole_rms_error, one.off.whole_rms_error));
    mean.push_back(ratio(std::abs(with.mean_error), without.rms_error));
    travel.push_back(ratio(with.travel_per_hour, without.travel_per_hour));
    reversals.push_back(ratio(with.reversals_per_hour, without.reversals_per_hour));
    parked.push_back(tried.result.parked ? 1.0 : 0.0);
    gain.push_back(tried.gain_per_s);
  }
  StickyRow row;
  row.name = name;
  row.share_falls = share_of(rms, [](double factor) { return factor < 1.0; });
  row.share_falls_5 = share_of(rms, [](double factor) { return factor < 1.0 - kNoticeable; });
  row.share_rises_5 = share_of(rms, [](double factor) { return factor > 1.0 + kNoticeable; });
  row.rms_factor = spread_of(rms);
  row.whole_rms_factor = spread_of(whole);
  row.mean_error = spread_of(mean).median;
  row.travel_factor = spread_of(travel).median;
  row.reversals_factor = spread_of(reversals).median;
  row.share_parked = share_of(parked, [](double is) { return is > 0.0; });
  row.gain_per_s = spread_of(gain).median;
  return row;
}

std::function<void(std::size_t)> progress_of(const StudyWork& work, std::size_t total) {
  if (!work.progress) return {};
  return [&work, total](std::size_t done) { work.progress(done, total); };
}

}  // namespace

std::vector<Plant1Row> study_plant1(std::uint64_t seed, const StudyWork& work) {
  std::vector<Plant1Row> rows = plant1_rows();
  const auto run = [&](std::size_t i) {
    Plant1Row& row = rows[i];
    row.result =
        run_with(plant1_trial(row.law.c_str(), row.s, row.j, seed), row.form, row.gain_per_s);
  };
  base::parallel_for(rows.size(), work.threads, run, progress_of(work, rows.size()));
  return rows;
}

ClaimCount count_claims(const std::vector<Plant1Row>& rows, JacketForm form) {
  ClaimCount count;
  const Plant1Row* off = nullptr;
  for (const Plant1Row& row : rows) {
    if (row.form == JacketForm::off) off = &row;
    if (row.form != form || off == nullptr) continue;
    const auto falls = [](double with, double without) {
      return with < (1.0 - kNoticeable) * without;
    };
    const analysis::LoopMetrics& with = row.result.settled;
    const analysis::LoopMetrics& without = off->result.settled;
    ++count.settings;
    count.rms_falls += falls(with.rms_error, without.rms_error) ? 1U : 0U;
    if (row.result.parked) {
      ++count.parked;
      continue;
    }
    if (with.reversals_per_hour <= 0.0) continue;
    const bool smaller = falls(row.result.pv_swing, off->result.pv_swing);
    const bool narrower = falls(row.result.co_swing, off->result.co_swing);
    const bool faster = falls(without.reversals_per_hour, with.reversals_per_hour);
    ++count.cycling;
    count.smaller += smaller ? 1U : 0U;
    count.narrower += narrower ? 1U : 0U;
    count.faster += faster ? 1U : 0U;
    count.all_three += smaller && narrower && faster ? 1U : 0U;
  }
  return count;
}

RandomLoop random_sticky_loop(std::uint64_t seed, std::size_t index, Load load) {
  Random random = stream(seed, index);
  RandomLoop loop;
  JacketTrial trial = random_loop(random);
  const double s = kOutputSpan * log_uniform(random, 0.01, 0.15);
  const double j = s * random.uniform(0.1, 1.0);
  loop.law = kLaws[static_cast<std::size_t>(random.uniform() * static_cast<double>(kLaws.size()))];
  trial.model.valve_effects = {stiction(loop.law.c_str(), s, j)};
  trial.read_back.bias = kOutputSpan * random.uniform(-0.002, 0.002);
  trial.read_back.noise = kOutputSpan * random.uniform(0.0, 0.0005);

  const double intensity = log_uniform(random, 0.0001, 0.001) * trial.model.transmitter.high;
  if (load == Load::wandering) trial.model.disturbances = {random_load(intensity)};

  // About 18 periods of the limit cycle at each set point, of which the first third is left out.
  const plant::ProcessParameters& process = trial.model.process;
  const double between_slips_s = 2.0 * s / (trial.model.controller.pid.gains.ki * process.gain * j);
  const double period_s =
      2.0 * between_slips_s + 4.0 * (process.time_constant_s + process.dead_time_s);
  trial.hold_s = std::clamp(18.0 * period_s, 900.0, 9000.0);
  trial.settling_s = trial.hold_s / 3.0;

  loop.chosen = trial;
  give_set_points_and_noise(loop.chosen, random);
  loop.reported = std::move(trial);
  give_set_points_and_noise(loop.reported, random);
  return loop;
}

JacketTrial random_healthy_loop(std::uint64_t seed, std::size_t index, ReadBackQuality quality) {
  Random random = stream(~seed, index);
  JacketTrial trial = random_loop(random);
  trial.model.valve_effects = {positioner_lag(random.uniform(0.0, 2.0))};
  const plant::ProcessParameters& process = trial.model.process;
  trial.hold_s = std::clamp(40.0 * (process.time_constant_s + process.dead_time_s), 300.0, 2000.0);
  trial.settling_s = trial.hold_s / 3.0;

  const double sign = random.uniform() < 0.5 ? -1.0 : 1.0;
  trial.read_back.bias = kOutputSpan * random.uniform(-0.002, 0.002);
  trial.read_back.noise = kOutputSpan * random.uniform(0.0, 0.0005);
  if (quality == ReadBackQuality::biased)
    trial.read_back.bias = kOutputSpan * sign * random.uniform(0.01, 0.03);
  if (quality == ReadBackQuality::noisy) trial.read_back.noise = kDeadZone;
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
                               const StudyWork& work) {
  std::vector<StickyCase> tried(cases);
  base::parallel_for(
      cases, work.threads,
      [&](std::size_t i) { tried[i] = try_case(random_sticky_loop(seed, i, load)); },
      progress_of(work, cases));

  StickyStudy study;
  study.load = load;
  if (tried.empty()) return study;
  std::vector<double> mean;
  for (const StickyCase& one : tried) {
    mean.push_back(ratio(std::abs(one.off.settled.mean_error), one.off.settled.rms_error));
    study.share_parked_off += one.off.parked ? 1.0 / static_cast<double>(cases) : 0.0;
  }
  study.mean_error_off = spread_of(mean).median;
  const std::vector<std::string> names = variant_names();
  for (std::size_t v = 0; v < names.size(); ++v)
    study.rows.push_back(summarise(names[v], tried, v));
  return study;
}

std::vector<HealthyRow> study_healthy_loops(std::size_t cases, std::uint64_t seed,
                                            const StudyWork& work) {
  constexpr std::array kQualities{ReadBackQuality::within_dead_zone, ReadBackQuality::biased,
                                  ReadBackQuality::noisy};
  constexpr std::array kForms{JacketForm::paper, JacketForm::bounded, JacketForm::dwell};
  struct Healthy {
    double rise_percent = 0.0;
    double whole_factor = 0.0;
  };
  using CaseResults = std::array<Healthy, kForms.size()>;
  std::vector<CaseResults> tried(cases * kQualities.size());
  const auto run = [&](std::size_t i) {
    const JacketTrial trial = random_healthy_loop(seed, i % cases, kQualities[i / cases]);
    const TrialResult off = run_with(trial, JacketForm::off, 0.0);
    for (std::size_t f = 0; f < kForms.size(); ++f) {
      const TrialResult on = run_with(trial, kForms[f], 1.0);
      const double rise = on.settled.rms_error - off.settled.rms_error;
      tried[i][f] = {.rise_percent = 100.0 * rise / trial.model.transmitter.high,
                     .whole_factor = ratio(on.whole_rms_error, off.whole_rms_error)};
    }
  };
  base::parallel_for(tried.size(), work.threads, run, progress_of(work, tried.size()));

  std::vector<HealthyRow> rows;
  if (cases == 0) return rows;
  for (std::size_t q = 0; q < kQualities.size(); ++q) {
    for (std::size_t f = 0; f < kForms.size(); ++f) {
      std::vector<double> rise, whole;
      for (std::size_t i = q * cases; i < (q + 1) * cases; ++i) {
        rise.push_back(tried[i][f].rise_percent);
        whole.push_back(tried[i][f].whole_factor);
      }
      rows.push_back(
          {.quality = kQualities[q],
           .form = kForms[f],
           .share_rises = share_of(rise, [](double r) { return r > kNoticeablePercent; }),
           .worst_rise_percent = spread_of(rise).worst,
           .whole_rms_factor = spread_of(whole)});
    }
  }
  return rows;
}

}  // namespace loopwarden::studies
