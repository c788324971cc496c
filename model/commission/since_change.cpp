// SPDX-License-Identifier: Apache-2.0
#include "model/commission/since_change.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include "model/effects/catalogue.hpp"
#include "model/monitor/load_watch.hpp"
#include "model/numeric/statistics.hpp"
#include "model/numeric/subplex.hpp"
#include "model/numeric/text.hpp"
#include "model/plant/plant.hpp"

namespace loopwarden::commission {
namespace {

using plant::Block;
using plant::EffectSpec;
using plant::LoopModel;

constexpr double kAlike = 2.0;
constexpr double kMostSure = 0.97;
constexpr double kLeastClosed = 0.5;
constexpr double kAllClosed = 0.8;
constexpr double kLeastSlip = 0.05;  // j over s
constexpr double kSureAt =
    1.5;  // t over the standard deviation of a normal distribution: confidence
constexpr double kMostSureOfTwo = 0.85;
constexpr double kForgets_s = 300.0;  // a load
constexpr std::size_t kCompared = 24;
constexpr int kMostRuns = 160;
constexpr int kFewRuns = 80;
// A slip that is missed spoils what follows, and one that comes is missed with a friction that is a little too large: no
// descent finds that. The search for a change of the valve tries sizes close together on so much of the record, and goes on
// with twice as much each time.
constexpr double kNear_s = 400.0;
constexpr double kFinely = 1.02;
struct Scan {
  double least;  // times what the search starts from
  double most;
  std::vector<double> shapes;
};

// A kind of change: what it is at a point of the search.
struct Kind {
  const char* name;
  Block block;
  std::vector<double> start;
  std::vector<double> steps;
  std::function<EffectSpec(const std::vector<double>&)> spec;
  bool ramps = false;  // until the record's end
};

// Scales of the loop and of what is left without a change.
struct Scales {
  double span;  // CO units
  double answer_s;
  double left;      // PV units, rms
  double after_s;   // from the earliest moment to the end
  double period_s;  // of what swings most in what is left
  double phase;
};

double positive(double x) { return std::exp(std::clamp(x, -12.0, 12.0)); }

std::vector<Kind> kinds(const Scales& s) {
  using X = std::vector<double>;
  const auto percent = [&](double p) { return std::log(0.01 * p * s.span); };
  const double w = 2.0 * std::numbers::pi / s.period_s;
  return {
      {"gain_change",
       Block::process,
       {0.0},
       {0.1},
       [](const X& x) {
         return EffectSpec{"gain_change", {{"factor", positive(x[0])}}};
       }},
      {"extra_dead_time",
       Block::process,
       {std::log(0.2 * s.answer_s)},
       {0.4},
       [](const X& x) {
         return EffectSpec{"extra_dead_time", {{"seconds", positive(x[0])}}};
       }},
      {"extra_lag",
       Block::process,
       {std::log(0.3 * s.answer_s)},
       {0.4},
       [](const X& x) {
         return EffectSpec{"extra_lag", {{"time_constant", positive(x[0])}}};
       }},
      {"step_disturbance",
       Block::transmitter,
       {0.0},
       {0.5 * s.left},
       [](const X& x) {
         return EffectSpec{"output_bias", {{"bias", x[0]}}};
       }},
      {"drift",
       Block::transmitter,
       {0.0},
       {0.5 * s.left},
       [](const X& x) {
         return EffectSpec{"output_bias", {{"bias", x[0]}}};
       },
       true},
      {"oscillating_disturbance",
       Block::disturbance,
       {std::log(s.left), 0.0, s.phase},
       {0.2, 0.02, 0.3},
       [w](const X& x) {
         return EffectSpec{"oscillating_disturbance",
                           {{"amplitude", positive(x[0])},
                            {"period", 2.0 * std::numbers::pi / w * positive(x[1])},
                            {"phase", x[2]}}};
       }},
      {"stiction",
       Block::valve,
       {percent(6.0), 0.0},
       {0.4, 0.7},
       [](const X& x) {
         const double size = positive(x[0]);
         // Without a slip it is a play.
         const double share = kLeastSlip + (1.0 - kLeastSlip) / (1.0 + positive(x[1]));
         return EffectSpec{"stiction", {{"s", size}, {"j", size * share}}};
       }},
      {"backlash",
       Block::valve,
       {percent(5.0)},
       {0.4},
       [](const X& x) {
         return EffectSpec{"backlash", {{"deadband", positive(x[0])}}};
       }},
      {"hysteresis",
       Block::valve,
       {percent(6.0)},
       {0.4},
       [](const X& x) {
         return EffectSpec{"hysteresis", {{"width", positive(x[0])}}};
       }},
      {"low_air_supply",
       Block::valve,
       {std::log(0.025 * s.span), std::log(0.65 * s.span), 0.0},
       {0.4, 0.1, 0.5},
       [](const X& x) {
         return EffectSpec{
             "low_air_supply",
             {{"rate", positive(x[0])}, {"travel_limit", positive(x[1])}, {"lag", positive(x[2])}}};
       }},
      {"positioner_overshoot",
       Block::valve,
       {0.0, -0.3},
       {0.4, 0.3},
       [](const X& x) {
         return EffectSpec{
             "positioner_overshoot",
             {{"damping", 0.6 / (1.0 + positive(-x[0]))}, {"natural_frequency", positive(x[1])}}};
       }},
  };
}

// How a hypothesis does: sums of e^2 from the change on.
struct Squares {
  double fitted = std::numeric_limits<double>::infinity();
  double held = std::numeric_limits<double>::infinity();
  std::vector<double> blocks{};
  double all() const noexcept { return fitted + held; }
};

struct Hypothesis {
  std::vector<std::size_t> kinds;  // by number
  std::vector<double> x;           // of each kind; last the moment, 0 earliest to 1 likeliest
  Squares errors;
};

class Competition {
 public:
  Competition(const gap::Record& record, ChangeMoment change, const LoopModel& twin,
              const numeric::ParallelFor& parallel)
      : record_(record),
        change_(change.earliest),
        latest_(std::max(change.earliest, change.likeliest)),
        parallel_(parallel) {
    twin_ = effects::without_noise(twin);
    twin_.scenario.faults.clear();
    const double h = record.period_s;
    const double rounding = twin.transmitter.resolution / std::sqrt(12.0);
    const double noise2 =
        std::max(twin.transmitter.noise * twin.transmitter.noise + rounding * rounding, 1e-12);
    const double drive = 2.0 * monitor::load_intensity(twin);
    const double drive2 = drive * drive * h;
    const double ahead2 = 0.5 * (drive2 + std::sqrt(drive2 * drive2 + 4.0 * drive2 * noise2));
    gain_ = std::max(ahead2 / (ahead2 + noise2), 1.0 - std::exp(-h / kForgets_s));
    warm_ = std::min(change_ / 2, static_cast<std::size_t>(5.0 * plant::answer_s(twin) / h));
    training_end_ = change_ + (record.size() - change_) * 2 / 3;
  }

  SinceChange run() {
    const Squares alone = errors_of(twin_, true);
    noise_ = before_ * static_cast<double>(count_);
    const double excess = alone.all() - noise_;
    if (!(excess > noise_ * kLeastExcess)) return {};
    kinds_ = kinds(scales());
    std::vector<Hypothesis> singles(kinds_.size());
    parallel_(kinds_.size(),
              [&](std::size_t i) { singles[i] = fitted({i}, kinds_[i].start, kLatest); });
    Hypothesis best = plainest(singles);
    const double to_close = std::max(best.errors.held - noise_ * held_share(), 0.0);
    if (to_close < kLeastForSecond * noise_ * held_share()) return describe(best, singles, alone);
    const std::vector<Hypothesis> seconds = pairs_with(best, 0);
    // The first was chosen without the second: it is chosen again beside it.
    const Hypothesis joined = plainest(seconds);
    const std::vector<Hypothesis> pairs = pairs_with(joined, joined.kinds.size() - 1);
    const Hypothesis second = plainest(pairs);
    const double left_by_both = std::max(second.errors.held - noise_ * held_share(), 0.0);
    const double gap = std::max(alone.held - noise_ * held_share(), 0.0);
    const bool both = left_by_both < 0.5 * to_close && to_close - left_by_both > kOfGap * gap &&
                      ahead(second, best) > kAlike;
    if (!both) return describe(best, singles, alone);
    SinceChange out = describe(second, pairs, alone);
    const auto alone_leaves = [&](std::size_t k) { return singles[second.kinds[k]].errors.all(); };
    // What explains more by itself is told first.
    if (out.effects.size() == 2 && alone_leaves(1) < alone_leaves(0)) {
      std::swap(out.effects[0], out.effects[1]);
    }
    return out;
  }

 private:
  static constexpr double kLeastExcess = 0.05;
  static constexpr double kLeastForSecond = 0.3;
  static constexpr double kOfGap = 0.05;  // what a second one closes at least
  static constexpr double kLatest = 1.0;
  static constexpr double kMomentStep = -0.4;  // as a share of the bounds
  static constexpr double kHardlyMore = 8.0;
  static constexpr int kMoments = 40;
  static constexpr double kTold = 1.96;     // t
  static constexpr double kNearest = 0.02;  // of a value, ends of its interval
  static constexpr double kFarthest = 2.0;

  // The kind at place `k` of a hypothesis beside each other one.
  std::vector<Hypothesis> pairs_with(const Hypothesis& of, std::size_t k) const {
    const std::size_t first = of.kinds[k];
    std::vector<Hypothesis> pairs(kinds_.size());
    parallel_(kinds_.size(), [&](std::size_t i) {
      if (i == first) return;
      std::vector<double> start = own(of, k);
      start.insert(start.end(), kinds_[i].start.begin(), kinds_[i].start.end());
      pairs[i] = fitted({first, i}, start, of.x.back());
    });
    return pairs;
  }

  // Of the kind at place `k`.
  std::vector<double> own(const Hypothesis& of, std::size_t k) const {
    std::size_t at = 0;
    for (std::size_t i = 0; i < k; ++i) at += kinds_[of.kinds[i]].start.size();
    const auto begin = of.x.begin() + static_cast<std::ptrdiff_t>(at);
    return {begin, begin + static_cast<std::ptrdiff_t>(kinds_[of.kinds[k]].start.size())};
  }

  // Sample at which a hypothesis begins.
  std::size_t moment_of(const Hypothesis& h) const {
    return change_ + static_cast<std::size_t>(std::lround(std::clamp(h.x.back(), 0.0, 1.0) *
                                                          static_cast<double>(latest_ - change_)));
  }

  double held_share() const {
    return static_cast<double>(count_held_) / static_cast<double>(std::max<std::size_t>(count_, 1));
  }

  double ramp_s(const Hypothesis& h) const { return before_end_s(moment_of(h)); }

  LoopModel model_of(const Hypothesis& h) const {
    LoopModel model = twin_;
    const double from_s = record_.period_s * static_cast<double>(moment_of(h));
    for (std::size_t k = 0; k < h.kinds.size(); ++k) {
      const Kind& kind = kinds_[h.kinds[k]];
      model.scenario.faults.push_back({kind.spec(own(h, k)),
                                       kind.block,
                                       {.from_s = from_s, .ramp_s = kind.ramps ? ramp_s(h) : 0.0}});
    }
    return model;
  }

  // `alone` leaves what is left beside the twin, for the scales.
  Squares errors_of(const LoopModel& model, bool alone = false) {
    std::vector<double>* left = alone ? &left_ : nullptr;
    return run_model(model, left, alone ? &before_ : nullptr, alone ? &count_ : nullptr,
                     alone ? &count_held_ : nullptr);
  }

  Squares errors_at(const Hypothesis& h) const {
    return run_model(model_of(h), nullptr, nullptr, nullptr, nullptr);
  }

  // Where the winner may have begun.
  gap::SampleRange moments_of(const Hypothesis& won) const {
    gap::SampleRange range{moment_of(won), moment_of(won)};
    if (latest_ == change_ || !(before_ > 0.0)) return range;
    std::vector<double> all(kMoments + 1);
    parallel_(all.size(), [&](std::size_t i) {
      Hypothesis other = won;
      other.x.back() = static_cast<double>(i) / kMoments;
      all[i] = errors_at(other).all();
    });
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (all[i] > won.errors.all() + kHardlyMore * before_) continue;
      Hypothesis other = won;
      other.x.back() = static_cast<double>(i) / kMoments;
      range.begin = std::min(range.begin, moment_of(other));
      range.end = std::max(range.end, moment_of(other));
    }
    return range;
  }

  Squares run_model(const LoopModel& model, std::vector<double>* left, double* before,
                    std::size_t* count, std::size_t* count_held,
                    std::size_t end = std::numeric_limits<std::size_t>::max()) const {
    Squares out{.fitted = 0.0, .held = 0.0, .blocks = std::vector<double>(kCompared, 0.0)};
    plant::Plant plant(model, 1);
    std::size_t k0 = 0;
    while (k0 < record_.size() && !std::isfinite(record_.co[k0])) ++k0;
    if (k0 == record_.size()) return out;
    plant.reset(record_.co[k0]);
    double co = record_.co[k0];
    double d = 0.0;
    double seen = 0.0;
    double squares_before = 0.0;
    std::size_t samples_before = 0;
    const std::size_t after = std::max<std::size_t>(record_.size() - change_, 1);
    for (std::size_t k = k0; k < std::min(end, record_.size()); ++k) {
      if (std::isfinite(record_.pv[k])) {
        const double e = record_.pv[k] - plant.process_variable() - d;
        seen += 1.0;
        d += std::max(gain_, 1.0 / std::min(seen, static_cast<double>(warm_) + 1.0)) * e;
        if (k < change_ && k > 2 * warm_) {
          squares_before += e * e;
          ++samples_before;
        }
        if (k >= change_) {
          (k < training_end_ ? out.fitted : out.held) += e * e;
          out.blocks[std::min(kCompared - 1, (k - change_) * kCompared / after)] += e * e;
          if (count != nullptr) ++*count;
          if (count_held != nullptr && k >= training_end_) ++*count_held;
          if (left != nullptr) left->push_back(record_.pv[k] - plant.process_variable());
        }
      }
      if (std::isfinite(record_.co[k])) co = record_.co[k];
      plant.step(co);
    }
    if (before != nullptr) {
      *before = samples_before > 0 ? squares_before / static_cast<double>(samples_before) : 0.0;
    }
    return out;
  }

  Scales scales() const {
    Scales s{.span = twin_.controller.pid.output_span(),
             .answer_s = plant::answer_s(twin_),
             .left = 0.0,
             .after_s = record_.period_s * static_cast<double>(record_.size() - change_),
             .period_s = 30.0,
             .phase = 0.0};
    std::vector<double> swing = left_;
    const double mean = numeric::mean(swing);
    for (double& r : swing) r -= mean;
    s.left = std::max(numeric::rms(swing), 1e-6);
    // The period whose sine takes most of it.
    double most = 0.0;
    for (double period = 8.0; period < std::min(200.0, 0.5 * s.after_s); period *= 1.02) {
      const double w = 2.0 * std::numbers::pi / period * record_.period_s;
      double in = 0.0;
      double quadrature = 0.0;
      for (std::size_t k = 0; k < swing.size(); ++k) {
        in += swing[k] * std::sin(w * static_cast<double>(k));
        quadrature += swing[k] * std::cos(w * static_cast<double>(k));
      }
      const double power = in * in + quadrature * quadrature;
      if (power <= most) continue;
      most = power;
      s.period_s = period;
      s.phase = std::remainder(std::atan2(quadrature, in) - w * static_cast<double>(change_),
                               2.0 * std::numbers::pi);
    }
    return s;
  }

  using Objective = std::function<double(const std::vector<double>&)>;

  // The best of `x` and of other sizes of the last kind, each with other shapes where it has a second parameter.
  std::vector<double> scanned(const Hypothesis& of, const std::vector<double>& x, const Scan& scan,
                              const Objective& objective) const {
    const std::size_t parameters = kinds_[of.kinds.back()].start.size();
    const std::size_t size = x.size() - 1 - parameters;
    std::vector<double> best = x;
    double least = objective(best);
    for (double by = scan.least; by < scan.most; by *= kFinely) {
      for (const double shape : scan.shapes) {
        if (parameters < 2 && shape != 0.0) continue;
        std::vector<double> at = x;
        at[size] += std::log(by);
        if (parameters > 1) at[size + 1] += shape;
        const double value = objective(at);
        if (!(value < least)) continue;
        least = value;
        best = std::move(at);
      }
    }
    return best;
  }

  Hypothesis fitted(std::vector<std::size_t> which, const std::vector<double>& start,
                    double moment) const {
    Hypothesis out{.kinds = std::move(which), .x = start, .errors = {}};
    out.x.push_back(moment);
    std::vector<double> steps;
    for (const std::size_t i : out.kinds) {
      steps.insert(steps.end(), kinds_[i].steps.begin(), kinds_[i].steps.end());
    }
    if (latest_ > change_) steps.push_back(kMomentStep);  // else it is known
    const auto errors = [&](const std::vector<double>& x) {
      return errors_at({.kinds = out.kinds, .x = x, .errors = {}});
    };
    const auto objective = [&](const std::vector<double>& x, std::size_t end) {
      try {
        return std::log(run_model(model_of({.kinds = out.kinds, .x = x, .errors = {}}), nullptr,
                                  nullptr, nullptr, nullptr, end)
                            .fitted);
      } catch (const effects::EffectError&) {
        return std::numeric_limits<double>::infinity();
      }
    };
    if (!std::isfinite(objective(out.x, training_end_))) return out;
    const numeric::SubplexSettings search{
        .most_evaluations = out.x.size() > 2 ? kMostRuns : kFewRuns,
        .value_change = 1e-5,
        .parameter_change = 1e-3};
    const auto descend = [&](std::vector<double>& x, const Objective& from) {
      const std::vector<double> moment_known(x.begin() + static_cast<std::ptrdiff_t>(steps.size()),
                                             x.end());
      x.resize(steps.size());
      numeric::subplex(
          x, steps, -50.0, 50.0,
          [&](std::vector<double> at) {
            at.insert(at.end(), moment_known.begin(), moment_known.end());
            return from(at);
          },
          search);
      x.insert(x.end(), moment_known.begin(), moment_known.end());
    };
    const auto before = [&](std::size_t end) -> Objective {
      return [&objective, end](const std::vector<double>& x) { return objective(x, end); };
    };
    if (kinds_[out.kinds.back()].block == Block::valve) {
      Scan scan{.least = 0.25,
                .most = 2.5,
                .shapes = {-2.5, -2.0, -1.6, -1.2, -0.8, -0.4, 0.0, 0.4, 0.8, 1.2, 1.6, 2.0, 2.5}};
      auto after = static_cast<std::size_t>(kNear_s / record_.period_s);
      for (std::size_t end = change_; end < training_end_; after *= 2) {
        end = std::min(change_ + after, training_end_);
        out.x = scanned(out, out.x, scan, before(end));
        descend(out.x, before(end));
        scan = {.least = 0.9, .most = 1.1, .shapes = {-0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3}};
      }
    } else {
      descend(out.x, before(training_end_));
    }
    try {
      out.errors = errors(out.x);
    } catch (const effects::EffectError&) {
      out.errors = {};
    }
    return out;
  }

  // t of a over b.
  static double ahead(const Hypothesis& a, const Hypothesis& b) {
    if (b.errors.blocks.empty()) return std::numeric_limits<double>::infinity();
    std::vector<double> less(kCompared);
    for (std::size_t i = 0; i < kCompared; ++i) less[i] = b.errors.blocks[i] - a.errors.blocks[i];
    const double deviation = numeric::deviation(less);
    const double mean = numeric::mean(less);
    return deviation > 0.0 ? mean / deviation * std::sqrt(static_cast<double>(kCompared)) : 0.0;
  }

  // Whether the blocks can't tell `other` from the best: it must leave next to nothing more, too.
  bool alike(const Hypothesis& best, const Hypothesis& other) const {
    const double more = other.errors.all() - best.errors.all();
    return std::isfinite(other.errors.all()) && ahead(best, other) < kAlike &&
           more < 0.1 * std::max(best.errors.all() - noise_, 0.0) + 0.02 * noise_;
  }

  const Hypothesis& plainest(const std::vector<Hypothesis>& all) const {
    const auto best = std::min_element(all.begin(), all.end(), [](const auto& a, const auto& b) {
      return a.errors.all() < b.errors.all();
    });
    const auto plain =
        std::find_if(all.begin(), all.end(), [&](const auto& one) { return alike(*best, one); });
    return plain == all.end() ? *best : *plain;
  }

  SinceChange describe(const Hypothesis& won, const std::vector<Hypothesis>& all,
                       const Squares& alone) const {
    SinceChange out;
    const double noise_held = noise_ * held_share();
    const double gap = alone.held - noise_held;
    // By then the load's filter may have taken over what no longer changes.
    const double left = gap > kLeastExcess * noise_held
                            ? (won.errors.held - noise_held) / gap
                            : (won.errors.all() - noise_) / (alone.all() - noise_);
    out.closed = std::clamp(1.0 - left, -1.0, 1.0);
    if (!(out.closed >= kLeastClosed)) return out;
    std::vector<std::string> alternatives;
    double nearest = std::numeric_limits<double>::infinity();
    for (const Hypothesis& rival : all) {
      if (rival.kinds.empty() || rival.kinds == won.kinds) continue;
      if (alike(won, rival)) {
        alternatives.emplace_back(kinds_[rival.kinds.back()].name);
      } else {
        nearest = std::min(nearest, ahead(won, rival));
      }
    }
    const double sure =
        0.5 + 0.5 * std::erf(std::max(nearest, 0.0) / (kSureAt * std::numbers::sqrt2));
    double confidence = std::min(won.kinds.size() > 1 ? kMostSureOfTwo : kMostSure, sure);
    if (!alternatives.empty()) {
      confidence =
          std::min(confidence, 1.0 / (1.0 + static_cast<double>(alternatives.size())) + 0.2);
    }
    if (out.closed < kAllClosed) confidence *= out.closed;
    out.corrected = model_of(won);
    out.corrected.scenario.faults.clear();
    out.at = moment_of(won);
    out.from = moments_of(won);
    for (std::size_t k = 0; k < won.kinds.size(); ++k) {
      out.effects.push_back(found(won, k));
      out.effects.back().confidence = confidence;
      out.effects.back().evidence = numeric::text(
          "With %s, since %.0f s before the last sample (%.0f to %.0f s), the twin explains %.0f "
          "%% of what it leaves alone, on data that were not fitted.",
          kinds_[won.kinds[k]].name, before_end_s(out.at), before_end_s(out.from.end),
          before_end_s(out.from.begin), 100.0 * out.closed);
      if (kinds_[won.kinds[k]].block == Block::valve) {
        out.effects.back().interval = intervals(won, k);
      }
    }
    std::vector<std::string>& also = out.effects.back().alternatives;
    also.insert(also.end(), alternatives.begin(), alternatives.end());
    return out;
  }

  double before_end_s(std::size_t sample) const {
    return record_.period_s * static_cast<double>(record_.size() - sample);
  }

  // Of the parameters of one of its effects.
  std::map<std::string, std::array<double, 2>> intervals(const Hypothesis& won,
                                                         std::size_t which) const {
    const LoopModel model = model_of(won);
    const auto told = [&](const std::string& name, double value) {
      LoopModel other = model;
      other.scenario.faults[which].effect.parameters[name] = value;
      try {
        const Hypothesis rival{.kinds = won.kinds,
                               .x = won.x,
                               .errors = run_model(other, nullptr, nullptr, nullptr, nullptr)};
        return ahead(won, rival) > kTold;
      } catch (const effects::EffectError&) {
        return true;
      }
    };
    std::map<std::string, std::array<double, 2>> out;
    for (const auto& [name, value] : model.scenario.faults[which].effect.parameters) {
      std::array<double, 2> ends{value, value};
      for (std::size_t end = 0; end < 2; ++end) {
        for (double off = kNearest; off < kFarthest; off *= 2.0) {
          ends[end] = end == 0 ? value / (1.0 + off) : value * (1.0 + off);
          if (told(name, ends[end])) break;
        }
      }
      out[name] = ends;
    }
    return out;
  }

  gap::FoundEffect found(const Hypothesis& won, std::size_t k) const {
    const Kind& kind = kinds_[won.kinds[k]];
    const std::vector<double> x = own(won, k);
    gap::FoundEffect effect;
    effect.spec = kind.spec(x);
    effect.block = kind.block;
    const double from_s = record_.period_s * static_cast<double>(moment_of(won));
    if (std::string(kind.name) == "step_disturbance") {
      effect.block = Block::disturbance;
      effect.spec = {"step_disturbance", {{"size", x[0]}, {"time", from_s}}};
      effect.alternatives = {"output_bias"};
    } else if (std::string(kind.name) == "drift") {
      effect.spec = {"drift", {{"rate", x[0] / ramp_s(won)}}};
    }
    return effect;
  }

  const gap::Record& record_;
  std::size_t change_;  // the earliest moment
  std::size_t latest_;
  const numeric::ParallelFor& parallel_;
  LoopModel twin_;
  double gain_ = 0.0;     // K
  std::size_t warm_ = 0;  // samples
  std::size_t training_end_ = 0;
  std::vector<Kind> kinds_;
  std::vector<double> left_;  // r after the change, PV units
  double before_ = 0.0;       // s^2
  double noise_ = 0.0;        // N s^2
  std::size_t count_ = 0;
  std::size_t count_held_ = 0;
};

}  // namespace

SinceChange since_change(const gap::Record& record, ChangeMoment change,
                         const plant::LoopModel& twin, const numeric::ParallelFor& parallel) {
  // Too little before it, and the load is not known; too little behind it, and nothing is.
  constexpr double kLeastAfter_s = 120.0;
  const bool known =
      change.earliest > 0 && record.has_co() &&
      record.period_s * static_cast<double>(record.size() - change.earliest) >= kLeastAfter_s;
  if (!known) return {};
  return Competition(record, change, twin, parallel).run();
}

}  // namespace loopwarden::commission
