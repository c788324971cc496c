// SPDX-License-Identifier: Apache-2.0
#include "model/gap/locate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "model/gap/constants.hpp"
#include "model/gap/record_check.hpp"

namespace loopwarden::gap {
namespace {

enum Condition : std::uint8_t {
  kSaturated,
  kAfterReversal,
  kAtRest,
  kFast,
  kHigh,
  kLow,
  kRising,
  kFalling,
  kConditions
};
constexpr std::array<const char*, kConditions> kConditionText{
    "while the controller output stands at a limit",
    "after the controller output reverses",
    "while the valve should rest",
    "while the controller output changes fast",
    "at high opening",
    "at low opening",
    "while the controller output rises",
    "while the controller output falls"};

std::vector<Condition> conditions_of(const std::vector<double>& co, const plant::LoopModel& model,
                                     double period_s) {
  const double low = model.controller.pid.output_low;
  const double span = model.controller.pid.output_high - low;
  const auto [used_low, used_high] = std::minmax_element(co.begin(), co.end());
  const auto dead = static_cast<std::size_t>(model.process.dead_time_s / period_s);
  const auto lag = std::max<std::size_t>(
      1, static_cast<std::size_t>((plant::answer_s(model) - model.process.dead_time_s) / period_s));
  const auto settle = dead + 2 * lag;
  // Reversals beyond a band of half a percent.
  std::vector<std::size_t> since(co.size(), co.size());
  std::size_t last = co.size();
  const std::vector<std::size_t> indices = reversals(co, 0.005 * span);
  std::size_t next = 0;
  for (std::size_t k = 0; k < co.size(); ++k) {
    if (next < indices.size() && indices[next] == k) last = indices[next++];
    if (last < co.size()) since[k] = k - last;
  }
  std::vector<Condition> out(co.size());
  for (std::size_t k = 0; k < co.size(); ++k) {
    const std::size_t cause = k >= dead ? k - dead : 0;  // PV now answers to CO then
    const double before = co[cause >= lag ? cause - lag : 0];
    const double far = co[k >= settle ? k - settle : 0];
    const double move = co[cause] - before;
    const double opening = (co[cause] - *used_low) / std::max(*used_high - *used_low, 1e-12);
    if (co[cause] <= low + 1e-3 * span || co[cause] >= low + (1.0 - 1e-3) * span) {
      out[k] = kSaturated;
    } else if (since[cause] < settle) {
      out[k] = kAfterReversal;
    } else if (std::abs(move) < 0.004 * span && std::abs(co[cause] - far) < 0.006 * span) {
      out[k] = kAtRest;
    } else if (std::abs(move) > 0.05 * span) {
      out[k] = kFast;
    } else if (opening > 2.0 / 3.0) {
      out[k] = kHigh;
    } else if (opening < 1.0 / 3.0) {
      out[k] = kLow;
    } else {
      out[k] = move > 0.0 ? kRising : kFalling;
    }
  }
  return out;
}

struct Pattern {
  const char* what = nullptr;
  effects::Block block = effects::Block::disturbance;
  double from_s = 0.0;
  double share = 0.0;  // of the energy
  enum class Shape : std::uint8_t { trend, level, constant, sine } shape = Shape::trend;
};

// The best of: a ramp from the start, a level from one moment on, a sine.
Pattern best_pattern(const std::vector<double>& r, double period_s) {
  const auto n = static_cast<double>(r.size());
  double total = 0.0;
  for (const double v : r) total += v * v;
  Pattern best;
  if (!(total > 0.0)) return best;
  const auto offer = [&](const char* what, effects::Block block, double from_s, double explained,
                         Pattern::Shape shape) {
    if (explained / total > best.share) best = {what, block, from_s, explained / total, shape};
  };
  double tt = 0.0;
  double tr = 0.0;
  for (std::size_t k = 0; k < r.size(); ++k) {
    const auto t = static_cast<double>(k);
    tt += t * t;
    tr += t * r[k];
  }
  offer("a slow drift", effects::Block::transmitter, 0.0, tr * tr / tt, Pattern::Shape::trend);
  double tail = 0.0;
  double tail_best = 0.0;
  std::size_t tail_at = 0;
  for (std::size_t k = r.size(); k-- > 0;) {
    tail += r[k];
    const double explained = tail * tail / (n - static_cast<double>(k));
    if (explained > tail_best) {
      tail_best = explained;
      tail_at = k;
    }
  }
  const bool from_start = static_cast<double>(tail_at) < 0.03 * n;
  offer(from_start ? "all the time, by a constant" : "from one moment on",
        effects::Block::disturbance, static_cast<double>(tail_at) * period_s, tail_best,
        from_start ? Pattern::Shape::constant : Pattern::Shape::level);
  const std::size_t stride = std::max<std::size_t>(1, r.size() / 2000);
  const double duration = n * period_s;
  for (double cycles = 3.0; cycles < n / static_cast<double>(8 * stride); cycles += 0.25) {
    double ss = 0.0;
    double cc = 0.0;
    std::size_t count = 0;
    for (std::size_t k = 0; k < r.size(); k += stride, ++count) {
      const double angle =
          2.0 * std::numbers::pi * cycles * static_cast<double>(k) * period_s / duration;
      ss += r[k] * std::sin(angle);
      cc += r[k] * std::cos(angle);
    }
    offer("periodically", effects::Block::disturbance, 0.0,
          2.0 * (ss * ss + cc * cc) / static_cast<double>(count) * n / static_cast<double>(count),
          Pattern::Shape::sine);
    if (cycles > 400.0) break;
  }
  best.share = std::min(best.share, 1.0);
  return best;
}

// Of PV less what a model makes of it; 0 where PV is missing.
struct Errors {
  std::vector<double> residual;  // PV units
  std::vector<double> energy;    // PV units squared
  double total = 0.0;
};

Errors errors_of(const std::vector<double>& pv, const std::vector<double>& simulated) {
  Errors out{std::vector<double>(pv.size(), 0.0), std::vector<double>(pv.size(), 0.0)};
  for (std::size_t k = 0; k < pv.size(); ++k) {
    const double r = pv[k] - simulated[k];
    if (!std::isfinite(r)) continue;
    out.residual[k] = r;
    out.energy[k] = r * r;
    out.total += out.energy[k];
  }
  return out;
}

void largest_first(std::vector<Located>& list) {
  std::sort(list.begin(), list.end(),
            [](const Located& a, const Located& b) { return a.share_of_gap > b.share_of_gap; });
}

// Relative to the spans, the controller's difference beside that of PV.
std::map<effects::Block, double> shares_of_blocks(const Disagreement& d) {
  const double pv_span = d.model.transmitter.span();
  const double co_span = d.model.controller.pid.output_span();
  const double floor = std::min(d.noise_floor_rmse, d.rmse);
  const double plant_energy = (d.rmse * d.rmse - floor * floor) / (pv_span * pv_span) + 1e-15;
  const double controller_energy = d.controller_rmse * d.controller_rmse / (co_span * co_span);
  const double sum = plant_energy + controller_energy;
  std::map<effects::Block, double> blocks;
  if (controller_energy > 0.0) blocks[effects::Block::controller] = controller_energy / sum;
  const double by_effects =
      std::accumulate(d.effects.begin(), d.effects.end(), 0.0,
                      [](double to, const LocatedEffect& e) { return to + e.energy; });
  for (const LocatedEffect& effect : d.effects) {
    const double part = by_effects > 0.0 ? effect.energy / by_effects : 1.0;
    blocks[effect.block] += plant_energy / sum * part;
  }
  if (d.effects.empty()) blocks[d.likely] += plant_energy / sum;
  return blocks;
}

// Stretches that stand out, and the rest.
std::vector<Located> by_time(const Disagreement& d, const Errors& errors, effects::Block worst) {
  constexpr std::size_t kMostStretches = 5;
  const std::size_t n = d.time_s.size();
  std::array<double, kTimeBins> bins{};
  for (std::size_t k = 0; k < n; ++k) bins[k * kTimeBins / n] += errors.energy[k] / errors.total;
  const auto bin_s = [&](std::size_t bin) {
    const std::size_t sample = bin * n / kTimeBins;
    return static_cast<double>(sample) * d.model.sample_time_s;
  };
  std::vector<Located> stretches;
  double rest = 0.0;
  for (std::size_t begin = 0; begin < kTimeBins;) {
    if (bins[begin] < kStandsOut / kTimeBins) {
      rest += bins[begin++];
      continue;
    }
    std::size_t end = begin;
    double share = 0.0;
    while (end < kTimeBins && bins[end] >= kStandsOut / kTimeBins) share += bins[end++];
    stretches.push_back(
        {LocatedBy::time, worst, "a stretch with a large error", bin_s(begin), bin_s(end), share});
    begin = end;
  }
  largest_first(stretches);
  for (; stretches.size() > kMostStretches; stretches.pop_back()) {
    rest += stretches.back().share_of_gap;
  }
  if (rest > 0.0) {
    stretches.push_back(
        {LocatedBy::time, worst,
         stretches.empty() ? "spread over the whole record" : "the rest of the record", 0.0,
         d.time_s.back(), rest});
  }
  return stretches;
}

std::vector<Located> by_condition(const Disagreement& d, const Errors& errors,
                                  effects::Block worst) {
  const std::size_t n = d.time_s.size();
  std::vector<Located> list;
  const Pattern pattern = best_pattern(errors.residual, d.model.sample_time_s);
  double left = 1.0;
  if (pattern.what != nullptr && pattern.share > kClearPattern) {
    list.push_back({LocatedBy::condition, worst, pattern.what, pattern.from_s, d.time_s.back(),
                    pattern.share});
    left -= pattern.share;
  }
  const std::vector<Condition> conditions = conditions_of(d.co, d.model, d.model.sample_time_s);
  std::array<double, kConditions> shares{};
  std::array<double, kConditions> peak{};
  std::array<std::size_t, kConditions> peak_at{};
  const std::size_t window = std::max<std::size_t>(1, n / 100);
  std::array<double, kConditions> running{};
  for (std::size_t k = 0; k < n; ++k) {
    shares[conditions[k]] += errors.energy[k] / errors.total;
    running[conditions[k]] += errors.energy[k];
    if (k >= window) running[conditions[k - window]] -= errors.energy[k - window];
    if (running[conditions[k]] > peak[conditions[k]]) {
      peak[conditions[k]] = running[conditions[k]];
      peak_at[conditions[k]] = k;
    }
  }
  for (std::size_t c = 0; c < kConditions; ++c) {
    if (shares[c] <= 0.0) continue;
    const std::size_t begin = peak_at[c] >= window ? peak_at[c] - window : 0;
    list.push_back({LocatedBy::condition, worst, kConditionText[c], d.time_s[begin],
                    d.time_s[peak_at[c]], shares[c] * left});
  }
  largest_first(list);
  return list;
}

}  // namespace

std::vector<Located> locate(const Disagreement& d) {
  std::vector<Located> located;
  const Errors errors = errors_of(d.pv, d.pv_before);
  if (!(errors.total > 0.0)) return located;
  const std::map<effects::Block, double> blocks = shares_of_blocks(d);
  for (const auto& [block, share] : blocks) {
    located.push_back(
        {LocatedBy::block, block,
         block == effects::Block::controller ? "controller, from SP and PV to CO" : "from CO to PV",
         0.0, d.time_s.back(), share});
  }
  const effects::Block worst =
      std::max_element(blocks.begin(), blocks.end(), [](const auto& a, const auto& b) {
        return a.second < b.second;
      })->first;
  for (const auto& list : {by_time(d, errors, worst), by_condition(d, errors, worst)}) {
    located.insert(located.end(), list.begin(), list.end());
  }
  return located;
}

LooksLike looks_like(const Leftover& d) {
  if (d.is_noise) return LooksLike::disturbance;
  const std::size_t n = d.pv.size();
  const Errors errors = errors_of(d.pv, d.pv_after);
  if (!(errors.total > 0.0)) return LooksLike::nothing_known;
  const Pattern pattern = best_pattern(errors.residual, d.model.sample_time_s);
  const bool clear = pattern.what != nullptr && pattern.share > kClearPattern;
  // A valve that sticks cycles as well: a sine is a disturbance only where no condition tells more.
  if (clear && pattern.shape != Pattern::Shape::sine) {
    return pattern.shape == Pattern::Shape::constant ? LooksLike::process : LooksLike::disturbance;
  }
  const std::vector<Condition> conditions = conditions_of(d.co, d.model, d.model.sample_time_s);
  std::array<double, kConditions> energy{};
  std::array<double, kConditions> samples{};
  for (std::size_t k = 0; k < n; ++k) {
    energy[conditions[k]] += errors.energy[k] / errors.total;
    samples[conditions[k]] += 1.0 / static_cast<double>(n);
  }
  // Rising and falling together are the process at work; each alone is a valve that differs.
  const double while_moving = energy[kFast] + energy[kRising] + energy[kFalling];
  const double moving = samples[kFast] + samples[kRising] + samples[kFalling];
  const auto worst =
      static_cast<std::size_t>(std::max_element(energy.begin(), energy.end()) - energy.begin());
  if (while_moving > energy[worst] && while_moving > kTellingCondition * moving) {
    return LooksLike::process;
  }
  if (energy[worst] <= kTellingCondition * samples[worst]) {
    return clear ? LooksLike::disturbance : LooksLike::nothing_known;
  }
  if (worst == kFast) return LooksLike::process;
  return d.model.has_valve ? LooksLike::valve : LooksLike::nothing_known;
}

}  // namespace loopwarden::gap
