// SPDX-License-Identifier: Apache-2.0
#include "model/twin/process_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string_view>
#include <utility>

#include "model/effects/catalogue.hpp"
#include "model/effects/valve_characteristic/valve_characteristic.hpp"
#include "model/estimator/constants.hpp"
#include "model/estimator/judgement.hpp"
#include "model/estimator/population.hpp"
#include "model/gap/model_run.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::twin {
namespace {

using effects::EffectSpec;
using estimator::Columns;
using estimator::Hypothesis;
using estimator::kLimits;
using estimator::Likelihood;
using estimator::LoopFacts;
using estimator::LoopRun;
using estimator::Slips;
using estimator::Solution;
using plant::LoopModel;
using plant::ProcessUncertainty;

constexpr double kLargest = 0.04;        // relative variance of what the record does not show
constexpr double kFree = 0.3;            // uncertainty of the process about the present model
constexpr double kRoughly = 0.6;         // of a process that is searched
constexpr double kLongestMove = 0.4;     // of ln parameter
constexpr double kSettled = 1e-3;        // of ln parameter
constexpr double kMostLevel = 0.05;      // of the PV span, from the stated level
constexpr double kFreeLevel = 0.05;      // of the PV span
constexpr double kForgets_s = 300.0;     // a disturbance
constexpr double kSlip = 0.15;           // j over s of a healthy valve
constexpr double kSureFriction = 1.0;    // Student's t over the parts
constexpr double kLeastFriction = 0.1;   // of the most
constexpr double kRatio = 1.6;           // from one tried size of friction to the next
constexpr double kBentDeviation = 0.04;  // of the CO span: of a point of the characteristic
constexpr double kLeastRise = 1e-6;      // CO units
constexpr std::size_t kHats = 8;

bool is_friction(const EffectSpec& spec) {
  constexpr std::array<std::string_view, 6> kNames{"stiction",        "backlash",   "hysteresis",
                                                   "cam_obstruction", "resolution", "learned"};
  return std::find(kNames.begin(), kNames.end(), spec.name) != kNames.end();
}

// The model beside a record, ready to be fitted.
class Linearised {
 public:
  Linearised(const FittedRecord& record, LoopModel model, ProcessUncertainty uncertainty,
             bool level_is_free = true)
      : record_(record),
        facts_(prepared(std::move(model), uncertainty, level_is_free, record.level)),
        run_(facts_, record.observed.co),
        likelihood_(facts_, run_, record.observed, record.fitted, record.noise_rms, slips_),
        none_(facts_, {}) {}

  const LoopFacts& facts() const noexcept { return facts_; }
  const LoopRun& run() const noexcept { return run_; }
  const Likelihood& likelihood() const noexcept { return likelihood_; }
  const Hypothesis& none() const noexcept { return none_; }

  // Solves at the best sizes of the error near `z`, which receives them.
  Solution solve(std::vector<double>& z, const estimator::Extra* extra = nullptr) const {
    Likelihood::Work work;
    work.extra = extra;
    z = estimator::with_best_error(likelihood_, none_, {z, -1e300}, work).z;
    Solution solution;
    likelihood_.of(none_, z, work, &solution);
    return solution;
  }
  std::vector<double> first_error() const { return std::vector<double>(none_.layout().size, 0.4); }
  std::vector<double> pv(const std::vector<double>& z, const Solution& solution) const {
    return likelihood_.simulate(none_, z, solution, record_.observed.pv.size());
  }

 private:
  static LoopModel prepared(LoopModel model, ProcessUncertainty uncertainty, bool level_is_free,
                            double stated) {
    const double off = std::abs(model.process.level.value_or(0.0) - stated);
    const bool at_bound = off >= 0.999 * kMostLevel * model.transmitter.span();
    model.has_valve = false;  // its dynamics are those of the effects of the model
    model.uncertainty = uncertainty;
    if (level_is_free && !at_bound) model.disturbances.push_back(any_level(model));
    return model;
  }

  const FittedRecord& record_;
  LoopFacts facts_;
  LoopRun run_;
  Slips slips_{};
  Likelihood likelihood_;
  Hypothesis none_;
};

double bounded(double move) { return std::clamp(move, -kLongestMove, kLongestMove); }

// Moves the process of a model to the solution. Returns the largest move, of ln parameter.
double move(LoopModel& model, const Solution& solution) {
  plant::ProcessParameters& p = model.process;
  const double gain = bounded(std::log(std::max(solution.gain(), 0.1)));
  const double lag = p.integrating() ? 0.0 : bounded(solution.mean(Columns::kLag));
  const double least_s = 0.5 * model.sample_time_s;
  const double dead_time_s = std::clamp(p.dead_time_s + solution.mean(Columns::kDeadTime),
                                        0.5 * p.dead_time_s, 1.5 * p.dead_time_s + least_s);
  const double later = std::abs(dead_time_s - p.dead_time_s) / std::max(p.dead_time_s, least_s);
  p.gain *= std::exp(gain);
  p.time_constant_s *= std::exp(lag);
  p.second_time_constant_s *= std::exp(lag);
  p.dead_time_s = dead_time_s;
  if (!p.integrating()) p.level = p.level.value_or(0.0) + solution.mean(Columns::kFirstFixed);
  return std::max({std::abs(gain), std::abs(lag), later});
}

plant::TwinFit posterior_of(const LoopModel& model, const Solution& solution) {
  struct Parameter {
    const char* name;
    Eigen::Index column;
    double scale;  // from the solution to the logarithm
  };
  const plant::ProcessParameters& p = model.process;
  std::vector<Parameter> parameters{{"gain", Columns::kGain, 1.0 / solution.gain()}};
  if (!p.integrating()) parameters.push_back({"time_constant", Columns::kLag, 1.0});
  if (p.dead_time_s > 0.0) {
    parameters.push_back({"dead_time", Columns::kDeadTime, 1.0 / p.dead_time_s});
  }
  const auto count = static_cast<std::size_t>(solution.innovations.size());
  const Eigen::Index size = solution.mean.size();
  const auto parts = static_cast<Eigen::Index>(kLimits.parts);
  Eigen::MatrixXd influence = Eigen::MatrixXd::Zero(size, parts);
  for (std::size_t k = 0; k < count; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    influence.col(static_cast<Eigen::Index>(k * kLimits.parts / count)) +=
        solution.design.row(i).transpose() * solution.innovations(i);
  }
  influence = (solution.covariance * influence).eval();
  influence.colwise() -= influence.rowwise().mean().eval();
  const Eigen::MatrixXd of_parts = influence * influence.transpose() *
                                   (static_cast<double>(parts) / static_cast<double>(parts - 1));
  plant::TwinFit out;
  for (const Parameter& a : parameters) {
    out.parameters.emplace_back(a.name);
    out.covariance.emplace_back();
    for (const Parameter& b : parameters) {
      const auto factor = [&](Eigen::Index c) {
        return std::sqrt(std::max(1.0, of_parts(c, c) / solution.covariance(c, c)));
      };
      const double both =
          0.5 * (solution.covariance(a.column, b.column) + solution.covariance(b.column, a.column));
      out.covariance.back().push_back(both * (factor(a.column) * factor(b.column)) *
                                      (a.scale * b.scale));
    }
  }
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (out.covariance[i][i] <= kLargest) continue;
    for (std::size_t j = 0; j < parameters.size(); ++j) {
      out.covariance[i][j] = out.covariance[j][i] = 0.0;
    }
    out.covariance[i][i] = kLargest;
  }
  return out;
}

ProcessFit fit_of(const FittedRecord& record, const Linearised& at, LoopModel model,
                  const std::vector<double>& z, const Solution& solution) {
  ProcessFit out{.model = std::move(model),
                 .posterior = {},
                 .log_likelihood = solution.log_likelihood,
                 .parts = estimator::parts_of(solution),
                 .pv = at.pv(z, solution)};
  out.posterior = posterior_of(out.model, solution);
  const gap::Misfit left = gap::misfit_of(record.observed.pv, out.pv, record.observed.used,
                                          record.fitted, record.noise_rms);
  out.training_rmse = left.training_rmse;
  out.holdout_rmse = left.holdout_rmse;
  return out;
}

bool explains_more(const ProcessFit& more, const ProcessFit& less, double lead, double least_t) {
  if (more.log_likelihood < less.log_likelihood + lead) return false;
  std::vector<double> by_part = more.parts;
  for (std::size_t b = 0; b < by_part.size(); ++b) by_part[b] -= less.parts[b];
  return numeric::mean(by_part) >
         least_t * numeric::deviation(by_part) / std::sqrt(static_cast<double>(by_part.size()));
}

// Flow of a characteristic at travel x, by a copy of its law.
double flow_at(const LoopModel& model, const EffectSpec* curve, double x) {
  if (curve == nullptr) return x;
  const control::PidSettings& pid = model.controller.pid;
  return effects::make_effect(*curve, {.sample_time_s = model.sample_time_s,
                                       .output_low = pid.output_low,
                                       .output_high = pid.output_high})
      .reset(x);
}

// Travels of the points of a table: most where CO was, at equal lengths of arc of the curve, and some
// beyond, where the table continues the curve.
std::vector<double> places(double from, double to, const control::PidSettings& pid,
                           const std::function<double(double)>& flow) {
  constexpr std::size_t kBeyond = 3;  // points on each side
  constexpr std::size_t kInside = effects::ValveCharacteristic::kMostPoints - 2 * kBeyond;
  constexpr std::size_t kSteps = 400;
  const double rise = std::max(flow(to) - flow(from), 1e-9);
  std::vector<double> arc{0.0};
  const auto at = [&](std::size_t i) {
    return from + (to - from) * static_cast<double>(i) / static_cast<double>(kSteps);
  };
  for (std::size_t i = 1; i <= kSteps; ++i) {
    arc.push_back(arc.back() + std::hypot(1.0 / static_cast<double>(kSteps),
                                          (flow(at(i)) - flow(at(i - 1))) / rise));
  }
  // Closer to each other near where CO was.
  const auto beyond = [](std::size_t i) {
    return static_cast<double>(i * i) / static_cast<double>(kBeyond * kBeyond);
  };
  std::vector<double> out;
  for (std::size_t i = kBeyond; i > 0; --i) {
    out.push_back(from + (pid.output_low - from) * beyond(i));
  }
  for (std::size_t i = 0; i < kInside; ++i) {
    const double length =
        arc.back() * static_cast<double>(i) / static_cast<double>(kInside - 1) - 1e-12;
    out.push_back(at(
        static_cast<std::size_t>(std::lower_bound(arc.begin(), arc.end(), length) - arc.begin())));
  }
  for (std::size_t i = 1; i <= kBeyond; ++i) out.push_back(to + (pid.output_high - to) * beyond(i));
  return out;
}

}  // namespace

EffectSpec any_level(const LoopModel& model) {
  return {"random_load",
          {{"intensity", kFreeLevel * model.transmitter.span() / std::sqrt(0.5 * kForgets_s)},
           {"time_constant", kForgets_s}}};
}

ProcessFit fit_process(const FittedRecord& record, const LoopModel& model, int most_moves) {
  LoopModel at = model;
  std::vector<double> z;
  for (int i = 0;; ++i) {
    const Linearised linear(record, at, {kFree, kFree, kFree});
    if (z.empty()) z = linear.first_error();
    const Solution solution = linear.solve(z);
    LoopModel next = at;
    const double moved = move(next, solution);
    if (next.process.level) {
      const double most = kMostLevel * next.transmitter.span();
      next.process.level =
          std::clamp(*next.process.level, record.level - most, record.level + most);
    }
    if (i + 1 >= most_moves || moved < kSettled) {
      return fit_of(record, linear, std::move(next), z, solution);
    }
    at = std::move(next);
  }
}

ProcessFit follow_process(const FittedRecord& record, const LoopModel& model) {
  const Linearised linear(record, model, {0.0, 0.0, 0.0}, false);
  std::vector<double> z = linear.first_error();
  const Solution solution = linear.solve(z);
  return fit_of(record, linear, model, z, solution);
}

LoopModel find_process(const FittedRecord& record, const LoopModel& model) {
  if (model.process.integrating()) return model;
  const Linearised linear(record, model, {kRoughly, kRoughly, kRoughly});
  Likelihood::Work work;
  const estimator::Population found = estimator::search(
      linear.likelihood(), linear.none(), {}, {.members = 48, .moves = 2, .first = 10}, 1, work);
  Solution solution;
  linear.likelihood().of(linear.none(), found.top().z, work, &solution);
  const estimator::Point point = linear.none().at(found.top().z);
  LoopModel out = model;
  const double slower = point.time_constant_s / model.process.time_constant_s;
  out.process.time_constant_s *= slower;
  out.process.second_time_constant_s *= slower;
  out.process.dead_time_s = point.dead_time_s;
  move(out, solution);
  return out;
}

ProcessFit bend_characteristic(const FittedRecord& record, const ProcessFit& fit) {
  const Linearised linear(record, fit.model, {kFree, kFree, kFree});
  const LoopFacts& facts = linear.facts();
  std::vector<double> z = linear.first_error();
  const estimator::Point point = linear.none().at(z);
  const std::size_t samples = record.observed.pv.size();
  std::vector<double> columns[3];
  std::vector<double> flow;
  linear.run().run(linear.none(), point, samples, nullptr, columns, &flow);
  const std::vector<double> fitted(flow.begin(),
                                   flow.begin() + static_cast<std::ptrdiff_t>(record.fitted));
  const double low = numeric::quantile(fitted, 0.01);
  const double high = numeric::quantile(fitted, 0.99);
  const double width = (high - low) / static_cast<double>(kHats - 1);
  if (!(width > 1e-4 * facts.co_span)) return fit;
  // A triangle about each place; beyond the ends the last one stays 1.
  const auto hat = [&](std::size_t i, double x) {
    const double at = low + width * static_cast<double>(i);
    return std::max(0.0, 1.0 - std::abs(std::clamp(x, low, high) - at) / width);
  };
  estimator::Extra extra;
  for (std::size_t i = 0; i < kHats; ++i) {
    std::vector<double> signal(samples);
    for (std::size_t k = 0; k < samples; ++k) signal[k] = hat(i, flow[k]);
    extra.signals.push_back(linear.run().response(linear.none(), point, std::move(signal)));
    extra.deviations.push_back(kBentDeviation * facts.co_span);
  }
  const Solution solution = linear.solve(z, &extra);
  const Eigen::VectorXd added = solution.mean.tail(kHats);

  LoopModel bent = fit.model;
  const auto curve = std::find_if(bent.valve_effects.begin(), bent.valve_effects.end(),
                                  [](const auto& s) { return s.name == "valve_characteristic"; });
  const EffectSpec old = curve == bent.valve_effects.end() ? EffectSpec{} : *curve;
  const EffectSpec* law = curve == bent.valve_effects.end() ? nullptr : &old;
  EffectSpec table{"valve_characteristic", {}, {{"curve", "table"}}};
  const control::PidSettings& pid = bent.controller.pid;
  std::vector<double> travel(record.observed.co);
  std::sort(travel.begin(), travel.end());
  const double from = travel[travel.size() / 100];
  const double to = travel[travel.size() - 1 - travel.size() / 100];
  const auto add = [&](double x) {
    double q = flow_at(bent, law, x);
    const double given = q;
    for (std::size_t i = 0; i < kHats; ++i) {
      q += added(static_cast<Eigen::Index>(i)) * hat(i, given);
    }
    if (table.table.empty() || (x > table.table.back().first + 1e-3 * (to - from) &&
                                q > table.table.back().second + kLeastRise)) {
      table.table.emplace_back(x, q);
    }
  };
  for (const double x : places(from, to, pid, [&](double x) { return flow_at(bent, law, x); })) {
    add(x);
  }
  if (table.table.size() < 3) return fit;
  if (curve != bent.valve_effects.end()) {
    *curve = std::move(table);
  } else {
    bent.valve_effects.push_back(std::move(table));
  }
  ProcessFit out = fit_process(record, bent);
  const bool better = explains_more(out, fit, kLimits.further_lead, kLimits.least_t) &&
                      (record.fitted == samples || out.holdout_rmse < fit.holdout_rmse);
  return better ? out : fit;
}

ProcessFit add_friction(const FittedRecord& record, const ProcessFit& fit, double most,
                        double& percent) {
  percent = 0.0;
  const LoopModel& model = fit.model;
  if (!(most > 0.0) ||
      std::any_of(model.valve_effects.begin(), model.valve_effects.end(), is_friction)) {
    return fit;
  }
  ProcessFit best = fit;
  for (const bool slips : {false, true}) {
    for (double size = most; size >= kLeastFriction * most; size /= kRatio) {
      LoopModel with = model;
      with.valve_effects.insert(with.valve_effects.begin(),
                                slips ? EffectSpec{"stiction", {{"s", size}, {"j", kSlip * size}}}
                                      : EffectSpec{"backlash", {{"deadband", size}}});
      ProcessFit tried = fit_process(record, with, 2);
      if (tried.log_likelihood <= best.log_likelihood) continue;
      best = std::move(tried);
      percent = 100.0 * size / model.controller.pid.output_span();
    }
  }
  if (percent > 0.0 && explains_more(best, fit, kLimits.first_lead, kSureFriction)) {
    return fit_process(record, best.model);
  }
  percent = 0.0;
  return fit;
}

double disturbance_of(const FittedRecord& record, const std::vector<double>& pv) {
  const estimator::Observed& observed = record.observed;
  double least = std::numeric_limits<double>::infinity();
  double gain = 0.0;
  for (double tried = 0.0; tried < 0.6; tried = tried == 0.0 ? 1e-5 : 1.1 * tried) {
    double level = 0.0;
    double squares = 0.0;
    double seen = 1.0;
    double counted = 0.0;
    for (std::size_t k = 0; k < record.fitted; ++k) {
      if (!observed.used[k]) continue;
      const double e = observed.pv[k] - pv[k] - level;
      seen += 1.0;
      if (tried > 0.0) level += std::max(tried, 1.0 / seen) * e;
      squares += e * e;
      counted += 1.0;
    }
    if (!(squares / counted < least)) continue;
    least = squares / counted;
    gain = tried;
  }
  // The steady gain K of a random walk of variance q per sample under noise of variance r:
  // K^2 / (1 - K) = q / r.
  return std::sqrt(least) * gain / std::sqrt((1.0 - gain) * observed.period_s);
}

}  // namespace loopwarden::twin
