// SPDX-License-Identifier: Apache-2.0
#include "model/twin/since_change.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <utility>

#include "model/effects/catalogue.hpp"
#include "model/watch/load_watch.hpp"
#include "model/numeric/statistics.hpp"
#include "model/numeric/subplex.hpp"
#include "model/numeric/text.hpp"
#include "model/plant/plant.hpp"

namespace loopwarden::twin {
namespace {

using effects::Block;
using effects::EffectSpec;
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
constexpr double kNear_s = 400.0;
constexpr double kUnseen_s = 180.0;
constexpr double kFinely = 1.02;
constexpr std::size_t kFollowed = 3;

// Sizes, shapes and moments that are tried.
struct Scan {
  double least;  // times what the search starts from
  double most;
  std::vector<double> shapes;
  std::vector<double> moments;  // beside where the search starts from
  std::size_t bands;
};
const Scan kWide{
    0.25, 2.5, {-2.4, -1.6, -1.2, -0.8, -0.4, 0.0, 0.4, 0.8, 1.2, 1.6, 2.4}, {0.0, -0.5, -1.0}, 8};
const Scan kBeside{0.9, 1.1, {-0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3}, {}, 1};

// A kind of change: what it is at a point of the search.
struct Kind {
  const char* name;
  Block block;
  std::vector<double> start;
  std::vector<double> steps;
  std::function<EffectSpec(const std::vector<double>&)> spec;
  bool ramps = false;  // until the record's end
  bool slips = false;  // in a way that the second parameter gives
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
       },
       false,
       true},
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

// How a hypothesis does, from the change on.
struct Sums {
  double fitted = std::numeric_limits<double>::infinity();  // sums of the bounded e^2
  double held = std::numeric_limits<double>::infinity();
  std::vector<double> blocks{};
  double square = 0.0;  // sums of e^2
  double square_held = 0.0;
  double all() const noexcept { return fitted + held; }
};

struct Hypothesis {
  std::vector<std::size_t> kinds;  // by number
  // Of each kind; last the moment: -1 kUnseen_s before the earliest, 0 the earliest, 1 the
  // likeliest.
  std::vector<double> x;
  Sums errors;
};

class Competition {
 public:
  Competition(const numeric::LoopRecord& record, ChangeMoment change, const LoopModel& twin,
              const numeric::ParallelFor& parallel)
      : record_(record),
        change_(change.earliest),
        latest_(std::max(change.earliest, change.likeliest)),
        counted_(change.earliest - std::min(change.earliest / 2,
                                            static_cast<std::size_t>(kUnseen_s / record.period_s))),
        parallel_(parallel) {
    twin_ = plant::without_noise(twin);
    twin_.scenario.faults.clear();
    const double h = record.period_s;
    const double rounding = twin.transmitter.resolution / std::sqrt(12.0);
    noise2_ =
        std::max(twin.transmitter.noise * twin.transmitter.noise + rounding * rounding, 1e-12);
    const double drive = 2.0 * watch::load_intensity(twin);
    const double drive2 = drive * drive * h;
    const double ahead2 = 0.5 * (drive2 + std::sqrt(drive2 * drive2 + 4.0 * drive2 * noise2_));
    gain_ = std::max(ahead2 / (ahead2 + noise2_), 1.0 - std::exp(-h / kForgets_s));
    warm_ = std::min(counted_ / 2, static_cast<std::size_t>(5.0 * plant::answer_s(twin) / h));
    training_end_ = change_ + (record.size() - change_) * 2 / 3;
  }

  SinceChange run() {
    learn_from_healthy();
    const Sums alone = errors_of(twin_);
    if (!(alone.square > noise_square_ * (1.0 + kLeastExcess))) return {};
    kinds_ = kinds(scales());
    if (!twin_.has_valve) {
      std::erase_if(kinds_, [](const Kind& kind) { return kind.block == Block::valve; });
    }
    std::vector<Hypothesis> singles(kinds_.size());
    parallel_(kinds_.size(),
              [&](std::size_t i) { singles[i] = fitted({i}, kinds_[i].start, kLatest); });
    Hypothesis best = plainest(singles);
    const double to_close = std::max(best.errors.held - noise_ * held_share_, 0.0);
    if (to_close < kLeastForSecond * noise_ * held_share_) return describe(best, singles, alone);
    const std::vector<Hypothesis> seconds = pairs_with(best, 0);
    // The first was chosen without the second: it is chosen again beside it.
    const Hypothesis joined = plainest(seconds);
    if (joined.kinds.empty()) return describe(best, singles, alone);
    const std::vector<Hypothesis> pairs = pairs_with(joined, joined.kinds.size() - 1);
    const Hypothesis second = plainest(pairs);
    const double left_by_both = std::max(second.errors.held - noise_ * held_share_, 0.0);
    const double gap = alone.square_held - noise_square_ * held_share_;
    const bool both = left_by_both < 0.5 * to_close &&
                      best.errors.square_held - second.errors.square_held > kOfGap * gap &&
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
  static constexpr double kBound = 3.0;  // noises
  static constexpr double kLeastForSecond = 0.3;
  static constexpr double kOfGap = 0.05;  // what a second one closes at least
  static constexpr double kLatest = 1.0;
  static constexpr double kMomentStep = -0.4;  // as a share of the bounds
  static constexpr double kHardlyMore = 8.0;
  static constexpr int kMoments = 80;
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

  // Sample at which a hypothesis begins: below 0 before the earliest moment at which a change is
  // seen.
  std::size_t moment_of(const Hypothesis& h) const {
    const double x = std::clamp(h.x.back(), -1.0, 1.0);
    const auto samples = [&](std::size_t from, std::size_t to) {
      return static_cast<std::size_t>(std::lround(std::abs(x) * static_cast<double>(to - from)));
    };
    return x < 0.0 ? change_ - samples(counted_, change_) : change_ + samples(change_, latest_);
  }

  double ramp_s(const Hypothesis& h) const { return before_end_s(moment_of(h)); }

  LoopModel model_of(const Hypothesis& h) const {
    LoopModel model = twin_;
    for (std::size_t k = 0; k < h.kinds.size(); ++k) {
      // The model's time begins with it.
      const double from_s = record_.period_s * static_cast<double>(moment_of(h) - begin_.sample);
      const Kind& kind = kinds_[h.kinds[k]];
      model.scenario.faults.push_back({kind.spec(own(h, k)),
                                       kind.block,
                                       {.from_s = from_s, .ramp_s = kind.ramps ? ramp_s(h) : 0.0}});
    }
    return model;
  }

  // Noise, load and what is left beside the twin alone.
  void learn_from_healthy() {
    while (begin_.sample < record_.size() && !std::isfinite(record_.co[begin_.sample]))
      ++begin_.sample;
    const std::size_t soon = counted_ - std::min(counted_, 3 * warm_);
    Start soon_before{};
    std::vector<double> healthy;
    follow(twin_, begin_, record_.size(),
           [&](std::size_t k, double e, double r, const Start& next) {
             if (k < counted_) {
               if (k > 2 * warm_) healthy.push_back(e);
               if (k <= soon) soon_before = next;
               return;
             }
             left_.push_back(r);
             if (k >= training_end_) held_share_ += 1.0;
           });
    if (std::isfinite(record_.co[soon_before.sample])) begin_ = soon_before;
    const auto count = static_cast<double>(left_.size());
    held_share_ /= std::max(count, 1.0);
    before_ = healthy.empty() ? 0.0 : std::pow(numeric::rms(healthy), 2);
    bound_ = kBound * kBound * std::max(before_, noise2_);
    double bounded_before = 0.0;
    for (const double e : healthy) bounded_before += bounded(e);
    noise_square_ = before_ * count;
    noise_ = healthy.empty() ? 0.0 : bounded_before / static_cast<double>(healthy.size()) * count;
  }

  double bounded(double e) const { return bound_ * std::log1p(e * e / bound_); }

  Sums errors_of(const LoopModel& model,
                 std::size_t end = std::numeric_limits<std::size_t>::max()) const {
    Sums out{.fitted = 0.0, .held = 0.0, .blocks = std::vector<double>(kCompared, 0.0)};
    const std::size_t after = std::max<std::size_t>(record_.size() - counted_, 1);
    follow(model, begin_, std::min(end, record_.size()),
           [&](std::size_t k, double e, double, const Start&) {
             if (k < counted_) return;
             const double error = bounded(e);
             (k < training_end_ ? out.fitted : out.held) += error;
             out.blocks[std::min(kCompared - 1, (k - counted_) * kCompared / after)] += error;
             out.square += e * e;
             if (k >= training_end_) out.square_held += e * e;
           });
    return out;
  }
  Sums errors_at(const Hypothesis& h) const { return errors_of(model_of(h)); }

  // Where the winner may have begun.
  gap::SampleRange moments_of(const Hypothesis& won) const {
    gap::SampleRange range{moment_of(won), moment_of(won)};
    if (!(before_ > 0.0)) return range;
    std::vector<Hypothesis> others(kMoments + 1, won);
    parallel_(others.size(), [&](std::size_t i) {
      others[i].x.back() = static_cast<double>(i) * 2.0 / kMoments - 1.0;
      others[i].errors = errors_at(others[i]);
    });
    for (const Hypothesis& other : others) {
      if (other.errors.all() > won.errors.all() + kHardlyMore * before_) continue;
      range.begin = std::min(range.begin, moment_of(other));
      range.end = std::max(range.end, moment_of(other));
    }
    return range;
  }

  // Where a model begins to follow the record: at rest on CO there, with a load of so much.
  struct Start {
    std::size_t sample = 0;
    double load = 0.0;
    double seen = 0.0;  // samples before it
  };

  // `each(k, e, r, start at the next sample)`.
  template <class Each>
  void follow(const LoopModel& model, Start at, std::size_t end, const Each& each) const {
    if (at.sample >= record_.size()) return;
    plant::Plant plant(model, 1);
    double co = record_.co[at.sample];
    plant.reset(co);
    for (; at.sample < end;) {
      const std::size_t k = at.sample++;
      if (std::isfinite(record_.pv[k])) {
        const double r = record_.pv[k] - plant.process_variable();
        const double e = r - at.load;
        at.seen += 1.0;
        at.load += std::max(gain_, 1.0 / std::min(at.seen, static_cast<double>(warm_) + 1.0)) * e;
        each(k, e, r, at);
      }
      if (std::isfinite(record_.co[k])) co = record_.co[k];
      plant.step(co);
    }
  }

  Scales scales() const {
    Scales s{.span = twin_.controller.pid.output_span(),
             .answer_s = plant::answer_s(twin_),
             .left = 0.0,
             .after_s = record_.period_s * static_cast<double>(record_.size() - counted_),
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
      s.phase = std::remainder(std::atan2(quadrature, in) - w * static_cast<double>(counted_),
                               2.0 * std::numbers::pi);
    }
    return s;
  }

  using Objective = std::function<double(const std::vector<double>&)>;

  // Places beside `x`: other sizes of the last kind, each with other shapes where it slips. The
  // best of each band of sizes, best first.
  std::vector<std::vector<double>> scanned(const Hypothesis& of, const std::vector<double>& x,
                                           const Scan& scan, const Objective& objective) const {
    const bool slips = kinds_[of.kinds.back()].slips;
    const std::size_t size = x.size() - 1 - kinds_[of.kinds.back()].start.size();
    std::vector<double> moments = scan.moments;
    moments.push_back(x.back());
    std::vector<std::pair<double, std::vector<double>>> best(scan.bands, {objective(x), x});
    const double range = std::log(scan.most / scan.least);
    for (double by = scan.least; by < scan.most; by *= kFinely) {
      auto& [least, where] = best[static_cast<std::size_t>(std::log(by / scan.least) / range *
                                                           static_cast<double>(scan.bands))];
      for (const double shape : scan.shapes) {
        if (!slips && shape != 0.0) continue;
        std::vector<double> at = x;
        at[size] += std::log(by);
        if (slips) at[size + 1] += shape;
        for (const double moment : moments) {
          at.back() = moment;
          const double value = objective(at);
          if (!(value < least)) continue;
          least = value;
          where = at;
        }
      }
    }
    std::sort(best.begin(), best.end());
    std::vector<std::vector<double>> out;
    for (auto& [value, where] : best) {
      if (out.empty() || where != out.back()) out.push_back(std::move(where));
    }
    return out;
  }

  Hypothesis fitted(std::vector<std::size_t> which, const std::vector<double>& start,
                    double moment) const {
    Hypothesis out{.kinds = std::move(which), .x = start, .errors = {}};
    out.x.push_back(moment);
    std::vector<double> steps;
    for (const std::size_t i : out.kinds) {
      steps.insert(steps.end(), kinds_[i].steps.begin(), kinds_[i].steps.end());
    }
    steps.push_back(kMomentStep);
    const auto objective = [&](const std::vector<double>& x, std::size_t end) {
      try {
        return std::log(
            errors_of(model_of({.kinds = out.kinds, .x = x, .errors = {}}), end).fitted);
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
      numeric::subplex(x, steps, -50.0, 50.0, from, search);
    };
    const auto before = [&](std::size_t end) -> Objective {
      return [&objective, end](const std::vector<double>& x) { return objective(x, end); };
    };
    const auto left_at = [&](const std::vector<double>& x) {
      try {
        return errors_at({.kinds = out.kinds, .x = x, .errors = {}});
      } catch (const effects::EffectError&) {
        return Sums{};
      }
    };
    const Kind& kind = kinds_[out.kinds.back()];
    if (kind.block != Block::valve) {
      std::vector<double> x = out.x;
      for (const double at : kWide.moments) {
        x.back() = at;
        if (objective(x, training_end_) < objective(out.x, training_end_)) out.x = x;
      }
      descend(out.x, before(training_end_));
      out.errors = left_at(out.x);
      return out;
    }
    const std::size_t near =
        std::max<std::size_t>(1, static_cast<std::size_t>(kNear_s / record_.period_s));
    std::vector<std::vector<double>> places =
        scanned(out, out.x, kWide, before(std::min(change_ + near, training_end_)));
    places.resize(std::min(places.size(), kind.slips ? kFollowed : 1));
    for (std::vector<double>& x : places) {
      std::size_t after = near;
      for (std::size_t end = change_; end < training_end_; after *= 2) {
        end = std::min(change_ + after, training_end_);
        if (after > near) x = scanned(out, x, kBeside, before(end)).front();
        descend(x, before(end));
      }
      // Which of the places goes on rightly, what was not fitted tells.
      Sums left = left_at(x);
      if (!(left.all() < out.errors.all())) continue;
      out.x = x;
      out.errors = std::move(left);
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
                       const Sums& alone) const {
    SinceChange out;
    const double noise_held = noise_square_ * held_share_;
    const double gap = alone.square_held - noise_held;
    // By then the load's filter may have taken over what no longer changes.
    const bool held_tells = gap > kLeastExcess * noise_held;
    const double left = held_tells
                            ? (won.errors.square_held - noise_held) / gap
                            : (won.errors.square - noise_square_) / (alone.square - noise_square_);
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
          "Explanation: %s, since %.0f s before the last sample (%.0f to %.0f s). It accounts for "
          "%.0f "
          "%% of the deviation %s.",
          kinds_[won.kinds[k]].name, before_end_s(out.at), before_end_s(out.from.end),
          before_end_s(out.from.begin), 100.0 * out.closed,
          held_tells
              ? "on the last third of the data. Its parameters are fitted to the data before that, "
                "but the kind of change is chosen on all data"
              : "on all data, most of which its parameters are fitted to, because the last third "
                "is not conclusive");
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
        const Hypothesis rival{.kinds = won.kinds, .x = won.x, .errors = errors_of(other)};
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

  const numeric::LoopRecord& record_;
  std::size_t change_;  // the earliest moment
  std::size_t latest_;
  std::size_t counted_;  // from which on errors are
  const numeric::ParallelFor& parallel_;
  LoopModel twin_;
  double gain_ = 0.0;     // K
  double noise2_ = 0.0;   // of a sample, the twin's
  std::size_t warm_ = 0;  // samples
  std::size_t training_end_ = 0;
  std::vector<Kind> kinds_;
  Start begin_;
  std::vector<double> left_;   // r of the twin alone from `counted_` on, PV units
  double held_share_ = 0.0;    // of its samples
  double before_ = 0.0;        // s^2
  double bound_ = 0.0;         // of an error, squared
  double noise_square_ = 0.0;  // N s^2
  double noise_ = 0.0;         // N times the mean bounded error before
};

}  // namespace

SinceChange since_change(const numeric::LoopRecord& record, ChangeMoment change,
                         const plant::LoopModel& twin, const numeric::ParallelFor& parallel) {
  // Too little before it, and the load is not known; too little behind it, and nothing is.
  constexpr double kLeastAfter_s = 120.0;
  const bool known =
      change.earliest > 0 && record.has_co() &&
      record.period_s * static_cast<double>(record.size() - change.earliest) >= kLeastAfter_s;
  if (!known) return {};
  return Competition(record, change, twin, parallel).run();
}

}  // namespace loopwarden::twin
