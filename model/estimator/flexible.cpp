// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/flexible.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/estimator/constants.hpp"
#include "model/estimator/judgement.hpp"

namespace loopwarden::estimator {
namespace {

enum Family : std::size_t {
  kStatic,
  kHysteretic,
  kDynamic,
  kByState,
  kGainByTime,
  kMeterPlay,
  kMeterCurve
};
constexpr std::array kFamilies{"static",       "hysteretic", "dynamic",    "by state",
                               "gain by time", "meter play", "meter curve"};

using Signal = std::vector<double>;

struct Column {
  Signal signal;
  double deviation;
  Family family;
};

// Triangles at `count` places from `low` to `high`; beyond the ends the last one stays 1.
std::vector<Signal> hats(const Signal& x, double low, double high, std::size_t count) {
  const double width = std::max((high - low) / static_cast<double>(count - 1), 1e-9);
  std::vector<Signal> out(count, Signal(x.size()));
  for (std::size_t i = 0; i < count; ++i) {
    const double at = low + width * static_cast<double>(i);
    for (std::size_t k = 0; k < x.size(); ++k) {
      out[i][k] = std::max(0.0, 1.0 - std::abs(std::clamp(x[k], low, high) - at) / width);
    }
  }
  return out;
}

Signal play_less(const Signal& x, double width) {
  Signal out(x.size());
  double at = x[0];
  for (std::size_t k = 0; k < x.size(); ++k) {
    at = std::clamp(at, x[k] - width / 2.0, x[k] + width / 2.0);
    out[k] = at - x[k];
  }
  return out;
}

Signal lagged(const Signal& x, double lag_s, double period_s) {
  Signal out(x.size());
  const double follows = 1.0 - std::exp(-period_s / lag_s);
  double at = x[0];
  for (std::size_t k = 0; k < x.size(); ++k) {
    at += follows * (x[k] - at);
    out[k] = at;
  }
  return out;
}

class FlexibleColumns {
 public:
  FlexibleColumns(const Likelihood& likelihood, const Fit& fit, std::size_t samples)
      : likelihood_(likelihood), loop_(likelihood.loop()), fit_(fit) {
    const Point point = fit.hypothesis.at(fit.population.top().z);
    Signal columns[3];
    likelihood.run().run(fit.hypothesis, point, samples, nullptr, columns, &flow_);
    z_ = std::move(columns[Columns::kGain]);
    h_ = likelihood.blocks().sample_time_s();
    fitted_ = likelihood.blocks().samples();
    add_valve(point);
    add_process();
    add_meter();
  }

  std::vector<Column> all;

 private:
  void add(Signal signal, double deviation, Family family) {
    all.push_back({std::move(signal), deviation, family});
  }
  std::pair<double, double> range(const Signal& x) const {
    const auto [low, high] =
        std::minmax_element(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(fitted_));
    return {*low, *high};
  }

  void add_valve(const Point& point) {
    const auto respond = [&](Signal flow) {
      return likelihood_.run().response(fit_.hypothesis, point, std::move(flow));
    };
    const auto [low, high] = range(flow_);
    for (Signal& hat : hats(flow_, low, high, 8)) {
      add(respond(std::move(hat)), 0.04 * loop_.co_span, kStatic);
    }
    for (const double width : {0.008, 0.016, 0.032, 0.064, 0.128}) {
      add(respond(play_less(flow_, width * loop_.co_span)), 0.5, kHysteretic);
    }
  }

  void add_process() {
    const double half = loop_.answer_s / 2.0;
    for (const double share : {0.5, 1.5, 5.0, 15.0}) {
      Signal v = lagged(z_, share * half, h_);
      for (std::size_t k = 0; k < v.size(); ++k) v[k] -= z_[k];
      add(std::move(v), 0.4, kDynamic);
    }
    for (const double share : {0.4, 0.8, 1.6}) {
      const auto delay = static_cast<std::size_t>(share * half / h_ + 1.0);
      Signal v(z_.size());
      for (std::size_t k = 0; k < v.size(); ++k) v[k] = z_[k > delay ? k - delay : 0] - z_[k];
      add(std::move(v), 0.4, kDynamic);
    }
    double mean = 0.0;
    for (std::size_t k = 0; k < fitted_; ++k) mean += z_[k] / static_cast<double>(fitted_);
    Signal rising(z_.size(), 0.0), by_level = rising, by_time = rising;
    for (std::size_t k = 1; k < z_.size(); ++k) {
      const double rate = (z_[k] - z_[k - 1]) / h_;
      rising[k] = std::max(0.0, rate);
      by_level[k] = rate * (z_[k] - mean) / (0.2 * loop_.pv_span);
      by_time[k] = rate * std::min(1.0, time_share(k));
    }
    const double lag_s = loop_.model.process.time_constant_s;
    add(lagged(rising, lag_s, h_), 0.5 * loop_.answer_s, kByState);
    add(lagged(by_level, lag_s, h_), 0.5 * loop_.answer_s, kByState);
    add(std::move(rising), 0.5 * loop_.answer_s, kByState);
    add(std::move(by_level), 0.3 * loop_.answer_s, kByState);
    add(std::move(by_time), 0.5 * loop_.answer_s, kByState);
    for (int i = 1; i <= 6; ++i) {
      Signal v(z_.size());
      for (std::size_t k = 0; k < v.size(); ++k) {
        v[k] = z_[k] * std::cos(std::numbers::pi * i * std::min(1.0, time_share(k)));
      }
      add(std::move(v), 0.15 / std::sqrt(static_cast<double>(i)), kGainByTime);
    }
  }

  void add_meter() {
    for (const double width : {0.015, 0.03, 0.06}) {
      add(play_less(z_, width * loop_.pv_span), 0.5, kMeterPlay);
    }
    const auto [low, high] = range(z_);
    for (Signal& hat : hats(z_, low, high, 6)) {
      add(std::move(hat), 0.04 * loop_.pv_span, kMeterCurve);
    }
  }

  double time_share(std::size_t k) const {
    return (static_cast<double>(k) + 0.5) / static_cast<double>(fitted_);
  }

  const Likelihood& likelihood_;
  const LoopFacts& loop_;
  const Fit& fit_;
  std::size_t fitted_ = 0;
  double h_ = 0.1;
  Signal flow_;  // CO units
  Signal z_;     // PV units
};

// A curve that isn't exactly the stated one is still a curve.
bool is_of(const Hypothesis& hypothesis, Family family) {
  // A model that does not know the process can lack neither dynamics nor a curve.
  const bool of_process =
      family == kStatic || family == kDynamic || family == kByState || family == kMeterCurve;
  if (hypothesis.wide() && of_process) return true;
  switch (family) {
    case kStatic: return hypothesis.contains("valve_characteristic");
    case kGainByTime: return hypothesis.contains("varying_gain");
    case kMeterCurve: return hypothesis.contains("meter_curve");
    case kHysteretic:
      return std::any_of(hypothesis.terms().begin(), hypothesis.terms().end(),
                         [](const Law* t) { return t->friction; });
    default: return false;
  }
}

}  // namespace

Flexible flexible_law(const Likelihood& likelihood, const Fit& fit, std::size_t samples) {
  const FlexibleColumns columns(likelihood, fit, samples);
  const std::vector<std::vector<Family>> sets{
      {kStatic},
      {kHysteretic},
      {kDynamic},
      {kDynamic, kByState},
      {kGainByTime},
      {kMeterPlay},
      {kMeterCurve},
      {kStatic, kHysteretic},
      {kStatic, kDynamic, kByState},
      {kStatic, kHysteretic, kDynamic, kByState, kGainByTime, kMeterPlay}};
  Flexible out;
  const auto disturbance_at = [&](const std::vector<double>& z) {
    const Point point = fit.hypothesis.at(z);
    return likelihood.errors()
        .size_at(likelihood.errors().index(point.disturbance, point.law))
        .disturbance;
  };
  out.disturbance = disturbance_at(fit.population.top().z);
  double best = fit.log_likelihood();
  for (const std::vector<Family>& set : sets) {
    Extra extra;
    for (const Column& column : columns.all) {
      if (std::find(set.begin(), set.end(), column.family) == set.end()) continue;
      if (is_of(fit.hypothesis, column.family)) continue;
      extra.signals.push_back(column.signal);
      extra.deviations.push_back(column.deviation);
    }
    Likelihood::Work work;
    work.extra = &extra;
    const Member member =
        with_best_error(likelihood, fit.hypothesis, {fit.population.top().z, -1e300}, work);
    if (member.log_likelihood <= best) continue;
    best = member.log_likelihood;
    out.lead = best - fit.log_likelihood();
    if (out.lead > kLimits.further_lead) out.disturbance = disturbance_at(member.z);
    out.family.clear();
    for (const Family family : set) {
      out.family += (out.family.empty() ? "" : " + ") + std::string(kFamilies[family]);
    }
    Solution solution;
    likelihood.of(fit.hypothesis, member.z, work, &solution);
    out.pv = likelihood.simulate(fit.hypothesis, member.z, solution, samples, &extra);
    out.parts = parts_of(solution);
    const std::vector<double> without = parts_of(fit.solution);
    for (std::size_t b = 0; b < out.parts.size(); ++b) out.parts[b] -= without[b];
  }
  return out;
}

}  // namespace loopwarden::estimator
