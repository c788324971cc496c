// SPDX-License-Identifier: Apache-2.0
#include "model/twin/polish.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "model/effects/catalogue.hpp"
#include "model/gap/check.hpp"
#include "model/gap/free_run.hpp"
#include "model/numeric/statistics.hpp"
#include "model/numeric/subplex.hpp"
#include "model/effects/valve_characteristic/valve_characteristic.hpp"

namespace loopwarden::twin {
namespace {

using effects::EffectSpec;
using plant::LoopModel;

constexpr std::array kGains{0.0, 0.0003, 0.001, 0.003, 0.01, 0.03};
constexpr double kSlip = 0.15;  // slip jump over s: friction falls by a quarter as the stem moves
constexpr double kLeastGain = 0.002;    // of sum e^2
constexpr double kWidest = 1.0;         // of x
constexpr double kFactor = 2.0;         // by which a number may be off, at x = 1
constexpr double kFirstStep = 0.1;      // of x
constexpr double kLeastFriction = 0.1;  // of the most
constexpr double kLeastRise = 1e-6;     // CO units, of a table that must rise
constexpr int kMostEvaluations = 500;
constexpr std::size_t kParts = 20;     // of the record
constexpr double kSureFriction = 2.0;  // standard deviations

bool is_friction(const EffectSpec& spec) {
  constexpr std::array<const char*, 6> kNames{"stiction",        "backlash",   "hysteresis",
                                              "cam_obstruction", "resolution", "learned"};
  return std::any_of(kNames.begin(), kNames.end(),
                     [&](const char* name) { return spec.name == name; });
}

// Cubic between the points and as monotone as they are (Fritsch and Carlson, SIAM J. Numer. Anal.
// 17 (1980)).
double monotone_cubic(const std::vector<std::pair<double, double>>& points, double at) {
  const auto slope = [&](std::size_t i) {
    return (points[i + 1].second - points[i].second) / (points[i + 1].first - points[i].first);
  };
  const auto tangent = [&](std::size_t i) {
    if (i == 0) return slope(0);
    if (i + 1 == points.size()) return slope(i - 1);
    const double a = slope(i - 1);
    const double b = slope(i);
    return a * b > 0.0 ? 2.0 * a * b / (a + b) : 0.0;
  };
  std::size_t i = 0;
  while (i + 2 < points.size() && at > points[i + 1].first) ++i;
  const double h = points[i + 1].first - points[i].first;
  const double t = std::clamp((at - points[i].first) / h, 0.0, 1.0);
  return points[i].second * (1.0 + 2.0 * t) * (1.0 - t) * (1.0 - t) +
         tangent(i) * h * t * (1.0 - t) * (1.0 - t) +
         points[i + 1].second * t * t * (3.0 - 2.0 * t) - tangent(i + 1) * h * t * t * (1.0 - t);
}

// A named curve as a table, which can be bent to what the valve and its line have made of it.
void tabulate(LoopModel& model) {
  constexpr int kPoints = 13;
  const control::PidSettings& pid = model.controller.pid;
  for (EffectSpec& spec : model.valve_effects) {
    if (spec.name != "valve_characteristic" || !spec.table.empty()) continue;
    effects::Effect curve = effects::make_effect(spec, {.sample_time_s = model.sample_time_s,
                                                        .output_low = pid.output_low,
                                                        .output_high = pid.output_high});
    EffectSpec table{"valve_characteristic", {}, {{"curve", "table"}}};
    for (int i = 0; i < kPoints; ++i) {
      const double at = pid.output_low + pid.output_span() * i / (kPoints - 1);
      table.table.emplace_back(at, curve.reset(at));
    }
    spec = std::move(table);
  }
}

// A table's few points go where the loop was, between the 1st and the 99th hundredth of CO: between
// points far apart a curve is none.
void move_points(LoopModel& model, std::vector<double> co) {
  std::sort(co.begin(), co.end());
  const double low = co[co.size() / 100];
  const double high = co[co.size() - 1 - co.size() / 100];
  constexpr std::size_t kInside = effects::ValveCharacteristic::kMostPoints - 2;
  for (EffectSpec& spec : model.valve_effects) {
    if (spec.name != "valve_characteristic" || spec.table.size() < 3) continue;
    const auto given = spec.table;
    spec.table = {given.front()};
    for (std::size_t i = 0; i < kInside; ++i) {
      const double at = low + (high - low) * static_cast<double>(i) / (kInside - 1.0);
      const double flow = monotone_cubic(given, at);
      const auto above = [&](const auto& point) {
        return at > point.first + 1e-3 * (high - low) && flow > point.second;
      };
      if (above(spec.table.back()) && given.back().first > at && given.back().second > flow) {
        spec.table.emplace_back(at, flow);
      }
    }
    spec.table.push_back(given.back());
  }
}

// What of a model is moved: each number by x in [-1, 1].
class Numbers {
 public:
  explicit Numbers(const LoopModel& model) : model_(model) {
    const auto process = [this](double plant::ProcessParameters::*value) {
      if (model_.process.*value > 0.0) {
        moves_.push_back(
            [value](LoopModel& m, double x) { m.process.*value *= std::pow(kFactor, x); });
      }
    };
    process(&plant::ProcessParameters::gain);
    if (!model.process.integrating()) process(&plant::ProcessParameters::time_constant_s);
    process(&plant::ProcessParameters::second_time_constant_s);
    process(&plant::ProcessParameters::dead_time_s);
    for (std::size_t i = 0; i < model.valve_effects.size(); ++i) add_effect(i);
  }

  // A friction in front of all else in the valve, CO units. x = -1: none to speak of.
  void add_friction(const std::string& name, double most) {
    model_.valve_effects.insert(model_.valve_effects.begin(), EffectSpec{name});
    moves_.clear();
    *this = Numbers(model_);
    moves_.push_back([name, most](LoopModel& m, double x) {
      const double size = most * (kLeastFriction + (1.0 - kLeastFriction) * 0.5 * (1.0 + x));
      EffectSpec& spec = m.valve_effects.front();
      if (name == "backlash") {
        spec.parameters = {{"deadband", size}};
      } else {
        spec.parameters = {{"s", size}, {"j", kSlip * size}};
      }
    });
  }

  std::size_t count() const noexcept { return moves_.size(); }
  LoopModel at(const std::vector<double>& x) const {
    LoopModel out = model_;
    for (std::size_t i = 0; i < moves_.size(); ++i) moves_[i](out, x[i]);
    return out;
  }

 private:
  void add_effect(std::size_t i) {
    const EffectSpec& spec = model_.valve_effects[i];
    if (spec.name == "valve_characteristic" && !spec.table.empty()) {
      // Both ends stay.
      for (const int power : {1, 2, 3, 4}) {
        moves_.push_back([i, power](LoopModel& m, double x) {
          auto& table = m.valve_effects[i].table;
          const double low = table.front().first;
          const double high = table.back().first;
          const auto weight = [&](double at) {
            const double y = 2.0 * (at - low) / (high - low) - 1.0;
            return std::exp(x * (std::pow(y, power) - 1.0));
          };
          for (auto& [at, flow] : table) flow *= weight(at);
          for (std::size_t k = 1; k < table.size(); ++k) {
            table[k].second = std::max(table[k].second, table[k - 1].second + kLeastRise);
          }
        });
      }
      return;
    }
    for (const char* name : {"rangeability", "s", "deadband", "width", "offset"}) {
      if (spec.parameters.count(name) == 0) continue;
      moves_.push_back([i, name](LoopModel& m, double x) {
        double& value = m.valve_effects[i].parameters.at(name);
        value *= std::pow(kFactor, x);
        if (std::string(name) == "rangeability") value = std::max(value, 1.05);
      });
    }
  }

  LoopModel model_;
  std::vector<std::function<void(LoopModel&, double)>> moves_;
};

struct Left {
  double fitted = std::numeric_limits<double>::infinity();  // sum e^2 over the first two thirds
  double held = std::numeric_limits<double>::infinity();    // over the last third
  std::size_t samples_held = 0;
  double gain = 0.0;  // K
  std::vector<double> blocks =
      std::vector<double>(kParts, 0.0);  // sum e^2 over parts of the record
};

class Errors {
 public:
  // Fitted to the first `fitted` samples.
  Errors(const gap::CheckedRecord& checked, std::size_t fitted)
      : checked_(checked), fitted_(fitted) {}

  // `start`: where the stem rests at first, CO units below CO.
  Left of(LoopModel model, double start) const {
    model.sample_time_s = checked_.model.sample_time_s;
    model = plant::without_noise(std::move(model));
    const std::vector<double> r = residual(model, start);
    Left best;
    for (const double gain : kGains) {
      const Left left = filtered(r, gain);
      if (left.fitted < best.fitted) best = left;
    }
    return best;
  }

 private:
  std::vector<double> residual(const LoopModel& model, double start) const {
    const gap::FreeRun run(model, checked_.co);
    gap::Point point;
    point.time_constant_s = model.process.time_constant_s;
    point.dead_time_s = model.process.dead_time_s;
    point.start_offset = start;
    std::vector<std::vector<double>> columns;
    run.columns({}, point, columns);
    const std::vector<double>& pv = checked_.pv;
    std::vector<double> r = run.with_past(point, columns, pv, checked_.measured, fitted_);
    for (std::size_t k = 0; k < r.size(); ++k) r[k] = pv[k] - r[k];
    return r;
  }

  Left filtered(const std::vector<double>& r, double gain) const {
    Left out{.fitted = 0.0, .held = 0.0, .gain = gain};
    double d = 0.0;
    double seen = 1.0;
    for (std::size_t k = 0; k < r.size(); ++k) {
      if (!checked_.used[k]) continue;
      const double e = r[k] - d;
      seen += 1.0;
      if (gain > 0.0) d += std::max(gain, 1.0 / seen) * e;
      (k < fitted_ ? out.fitted : out.held) += e * e;
      out.blocks[k * kParts / r.size()] += e * e;
      if (k >= fitted_) ++out.samples_held;
    }
    return out;
  }

  const gap::CheckedRecord& checked_;
  std::size_t fitted_;
};

struct Attempt {
  LoopModel model;
  Left left;
};

Attempt search(const Numbers& numbers, const Errors& errors, double band) {
  // Every number, and the place of the stem at first within the friction's band.
  std::vector<double> x(numbers.count() + 1, 0.0);
  const auto of = [&](const std::vector<double>& at) {
    return errors.of(numbers.at(at), 0.5 * band * at.back());
  };
  numeric::subplex(
      x, std::vector<double>(x.size(), kFirstStep), -kWidest, kWidest,
      [&](const std::vector<double>& at) { return std::log(of(at).fitted); },
      {.most_evaluations = kMostEvaluations, .value_change = 1e-6, .parameter_change = 1e-4});
  return {numbers.at(x), of(x)};
}

bool better(const Left& a, const Left& b) {
  return a.fitted < (1.0 - kLeastGain) * b.fitted && a.held < b.held;
}

// Whether the interval of a friction leaves 0 out: all over the record, not in some of its parts,
// it explains more than none.
bool is_sure(const Left& with, const Left& without) {
  std::vector<double> less(kParts);
  for (std::size_t i = 0; i < kParts; ++i) less[i] = without.blocks[i] - with.blocks[i];
  const double parts = static_cast<double>(kParts);
  return numeric::mean(less) > kSureFriction * numeric::deviation(less) / std::sqrt(parts);
}

}  // namespace

Polished polish(const LoopModel& model, const numeric::LoopRecord& record, double most_friction) {
  Polished out{.model = model};
  if (!record.has_co()) return out;
  const gap::CheckedRecord checked = gap::check(record, model);
  if (!checked.quality.usable || checked.closed_loop) return out;
  const Errors errors(checked, gap::training_samples(checked.pv.size()));
  Attempt best{model, errors.of(model, 0.0)};
  const auto offer = [&](const Attempt& attempt) {
    if (!better(attempt.left, best.left)) return false;
    best = attempt;
    out.changed = true;
    return true;
  };
  offer(search(Numbers(model), errors, most_friction));
  LoopModel bent = best.model;
  tabulate(bent);
  move_points(bent, checked.co);
  if (!(bent == best.model)) offer(search(Numbers(bent), errors, most_friction));
  const bool has_friction =
      std::any_of(model.valve_effects.begin(), model.valve_effects.end(), is_friction);
  if (!has_friction && most_friction > 0.0) {
    const LoopModel without = best.model;
    const Left left_without = best.left;
    for (const char* name : {"backlash", "stiction"}) {
      Numbers numbers(without);
      numbers.add_friction(name, most_friction);
      const Attempt with = search(numbers, errors, most_friction);
      if (!is_sure(with.left, left_without) || !offer(with)) continue;
      const auto& parameters = with.model.valve_effects.front().parameters;
      const control::PidSettings& pid = model.controller.pid;
      out.friction_percent =
          100.0 * parameters.at(parameters.count("s") > 0 ? "s" : "deadband") / pid.output_span();
    }
  }
  out.model = best.model;
  out.rms_error = std::sqrt(best.left.held /
                            static_cast<double>(std::max<std::size_t>(best.left.samples_held, 1)));
  // The steady gain K of a random walk of variance q a sample under noise of variance r: K^2 / (1 -
  // K) = q / r.
  const double k = best.left.gain;
  out.load_intensity = out.rms_error * k / std::sqrt((1.0 - k) * model.sample_time_s);
  return out;
}

LoopModel refitted(const LoopModel& model, const numeric::LoopRecord& record) {
  if (!record.has_co()) return model;
  const gap::CheckedRecord checked = gap::check(record, model);
  if (!checked.quality.usable || checked.closed_loop) return model;
  const Errors errors(checked, checked.pv.size());
  const Attempt whole = search(Numbers(model), errors, 0.0);
  return whole.left.fitted < errors.of(model, 0.0).fitted ? whole.model : model;
}

}  // namespace loopwarden::twin
