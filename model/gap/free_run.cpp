// SPDX-License-Identifier: Apache-2.0
#include "model/gap/free_run.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include <Eigen/Dense>

#include "model/numeric/two_columns.hpp"

namespace loopwarden::gap {
namespace {

using effects::Block;
using effects::EffectSpec;

effects::EffectChain chain_of(const std::vector<EffectSpec>& specs, Block block,
                              const effects::EffectContext& context) {
  effects::EffectChain chain;
  for (const EffectSpec& spec : specs) {
    const effects::Descriptor* info = effects::find_effect(spec.name);
    if (info != nullptr && info->is_noise) continue;
    effects::check_effect(spec, block, context);
    chain.add(effects::make_effect(spec, context));
  }
  return chain;
}

int valve_rank(const EffectSpec& spec) {
  const effects::Descriptor* info = effects::find_effect(spec.name);
  return info != nullptr ? info->valve_rank : effects::Descriptor{}.valve_rank;
}

// Puts an effect of the valve at its place; one of the same name is replaced.
void place_in_valve(std::vector<EffectSpec>& valve, EffectSpec spec) {
  std::erase_if(valve, [&](const EffectSpec& s) { return s.name == spec.name; });
  const auto behind = std::find_if(valve.begin(), valve.end(), [&](const EffectSpec& s) {
    return valve_rank(s) > valve_rank(spec);
  });
  valve.insert(behind, std::move(spec));
}

EffectSpec with_actuator(const Candidate& candidate, EffectSpec spec, const Point& point) {
  if (candidate.with_momentum == nullptr || point.actuator_frequency <= 0.0) return spec;
  return candidate.with_momentum(std::move(spec), point.actuator_frequency, point.actuator_damping);
}

// A healthy valve's friction and momentum, where no effect of the valve has them already.
void allow_for_healthy_valve(std::vector<EffectSpec>& valve, const Point& point) {
  if (point.actuator_frequency <= 0.0) return;
  for (const EffectSpec& spec : valve) {
    const effects::Descriptor* info = effects::find_effect(spec.name);
    if (info != nullptr && info->healthy_valve != nullptr) return;
  }
  for (const effects::Descriptor& info : effects::effect_catalogue()) {
    if (info.healthy_valve == nullptr) continue;
    place_in_valve(valve, info.healthy_valve(point.friction, point.actuator_frequency,
                                             point.actuator_damping));
  }
}

constexpr int kPastRounds = 4;

constexpr double kTrace =
    1e-12;  // where nothing shows the state that the process brought along, it is 0

// How far from CO the stem can rest at the start, CO units.
double start_offset(const Candidate& candidate, const std::vector<double>& searched) {
  if (!candidate.starts_offset()) return 0.0;
  const double half_band = candidate.resting_half_band(searched);
  return searched.back() * half_band;
}

}  // namespace

FreeRun::FreeRun(plant::LoopModel model, std::vector<double> co, Level level)
    : model_(std::move(model)),
      context_{.sample_time_s = model_.sample_time_s,
               .output_low = model_.controller.pid.output_low,
               .output_high = model_.controller.pid.output_high,
               .pv_low = model_.transmitter.low,
               .pv_high = model_.transmitter.high},
      co_(std::move(co)),
      level_(level),
      disturbances_(chain_of(model_.disturbances, Block::disturbance, context_)),
      transmitter_effects_(transmitter_chain(false)),
      reading_effects_(transmitter_chain(true)),
      plain_transmitter_(disturbances_.empty() && transmitter_effects_.empty()) {
  (void)chain_of(model_.valve_effects, Block::valve, context_);  // checks them
  (void)chain_of(model_.process_effects, Block::process, context_);
  const double stated = model_.process.level.value_or(0.0);
  offset_.assign(co_.size(), stated);
  if (plain_transmitter_) return;
  effects::EffectChain disturbances = disturbances_;
  effects::EffectChain transmitter = transmitter_effects_;
  for (std::size_t k = 0; k < co_.size(); ++k) {
    const double now_s = static_cast<double>(k) * model_.sample_time_s;
    offset_[k] = k == 0 ? transmitter.reset(disturbances.reset(stated, 0.0), 0.0)
                        : transmitter.step(disturbances.step(stated, now_s), now_s);
  }
}

effects::EffectChain FreeRun::transmitter_chain(bool of_reading) const {
  effects::EffectChain chain;
  for (const EffectSpec& spec : model_.transmitter_effects) {
    const effects::Descriptor* info = effects::find_effect(spec.name);
    if (info != nullptr && info->is_noise) continue;
    effects::check_effect(spec, Block::transmitter, context_);
    effects::Effect effect = effects::make_effect(spec, context_);
    if (effect.acts_on_reading() == of_reading) chain.add(std::move(effect));
  }
  return chain;
}

bool FreeRun::shows_all(const Terms& terms) const noexcept {
  return reading_effects_.empty() &&
         std::none_of(terms.begin(), terms.end(), [](const Candidate* t) { return t->shown(); });
}

void FreeRun::show(const Terms& terms, const Point& point, std::vector<double>& pv) const {
  effects::EffectChain reading = reading_effects_;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (!terms[i]->shown()) continue;
    reading.add(effects::make_effect(terms[i]->effect(point.searched[i], {}), context_));
  }
  if (reading.empty() || pv.empty()) return;
  pv[0] = reading.reset(pv[0], 0.0);
  reading.run(std::span<double>(pv).subspan(1), model_.sample_time_s, model_.sample_time_s);
}

std::vector<double> FreeRun::slopes(const Terms& terms, const Point& point,
                                    std::vector<double> pv) const {
  if (shows_all(terms)) return std::vector<double>(pv.size(), 1.0);
  constexpr double kStep = 1e-6;  // of the transmitter's span
  const double step = kStep * model_.transmitter.span();
  std::vector<double> higher = pv;
  for (double& v : higher) v += step;
  show(terms, point, pv);
  show(terms, point, higher);
  for (std::size_t k = 0; k < pv.size(); ++k) pv[k] = (higher[k] - pv[k]) / step;
  return pv;
}

std::size_t FreeRun::column_count(const Terms& terms) const noexcept {
  std::size_t count = base_columns();
  for (const Candidate* term : terms) count += term->linear_columns();
  return count;
}

void FreeRun::pass_transmitter(std::vector<double>& signal) const {
  if (plain_transmitter_) return;
  effects::EffectChain disturbances = disturbances_;
  effects::EffectChain transmitter = transmitter_effects_;
  const double level = model_.process.level.value_or(0.0);
  for (std::size_t k = 0; k < signal.size(); ++k) {
    const double now_s = static_cast<double>(k) * model_.sample_time_s;
    const double at = level + signal[k];
    const double pv = k == 0 ? transmitter.reset(disturbances.reset(at, 0.0), 0.0)
                             : transmitter.step(disturbances.step(at, now_s), now_s);
    signal[k] = pv - offset_[k];
  }
}

void FreeRun::linear_columns(const Candidate& candidate, const std::vector<double>& searched,
                             std::vector<std::vector<double>>& columns) const {
  columns.resize(candidate.linear_columns());
  for (auto& column : columns) column.assign(co_.size(), 1.0);
  if (candidate.fill != nullptr) candidate.fill(searched, model_.sample_time_s, columns);
  // A sensor's own fault is not seen through the sensor's lag.
  if (candidate.block == Block::disturbance) {
    for (auto& column : columns) pass_transmitter(column);
  }
}

FreeRun::Chains FreeRun::chains(const Terms& terms, const Point& point) const {
  std::vector<EffectSpec> valve = model_.valve_effects;
  std::vector<EffectSpec> process_effects = model_.process_effects;
  std::vector<EffectSpec> transmitter;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (!terms[i]->in_path()) continue;
    EffectSpec spec = with_actuator(*terms[i], terms[i]->effect(point.searched[i], {}), point);
    switch (terms[i]->block) {
      case Block::valve: place_in_valve(valve, std::move(spec)); break;
      case Block::transmitter: transmitter.push_back(std::move(spec)); break;
      default: process_effects.push_back(std::move(spec));
    }
  }
  allow_for_healthy_valve(valve, point);
  effects::EffectContext context = context_;
  context.dead_time_s = point.dead_time_s;
  return {chain_of(valve, Block::valve, context),
          chain_of(process_effects, Block::process, context),
          chain_of(transmitter, Block::transmitter, context),
          effects::takes_dead_time(process_effects)};
}

void FreeRun::columns(const Terms& terms, const Point& point,
                      std::vector<std::vector<double>>& columns, std::size_t samples) const {
  const std::size_t n = std::min(samples, co_.size());
  const double h = model_.sample_time_s;
  columns.resize(column_count(terms));
  for (std::size_t i = 0; i < base_columns(); ++i) columns[i].resize(n);
  if (fits_level()) {
    std::vector<double>& level = columns[base_columns() - 1];
    std::fill(level.begin(), level.end(), 1.0);
  }

  auto [valve_chain, process_chain, transmitter_chain, with_dead_time] = chains(terms, point);
  const auto pass_terms = [h, &transmitter = transmitter_chain](std::vector<double>& signal) {
    if (transmitter.empty()) return;
    signal[0] = transmitter.reset(signal[0], 0.0);
    transmitter.run(std::span<double>(signal).subspan(1), h, h);
  };
  const double offset = start_offset(terms, point);
  plant::Process process(process_at(point, 1.0, !with_dead_time), h);

  // A stem at rest beside CO: it came from where its band ends.
  double flow = valve_chain.reset(co_[0] - offset, 0.0);
  if (offset != 0.0) flow = valve_chain.step(co_[0], 0.0);
  auto& z = columns[0];
  z[0] = process.reset(process_chain.reset(flow, 0.0));
  const std::span<double> moves(z.data() + 1, n - 1);
  std::copy_n(co_.begin(), n - 1, moves.begin());
  valve_chain.run(moves, 0.0, h);
  process_chain.run(moves, 0.0, h);
  for (double& v : moves) v = process.step(v);
  fill_past(point, columns);
  for (std::size_t i = 0; i < base_columns(); ++i) {
    pass_transmitter(columns[i]);
    pass_terms(columns[i]);
  }

  std::size_t next = base_columns();
  std::vector<std::vector<double>> own;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (terms[i]->linear_columns() == 0) continue;
    linear_columns(*terms[i], point.searched[i], own);
    for (auto& column : own) {
      if (terms[i]->block == Block::disturbance) pass_terms(column);
      columns[next++] = std::move(column);
    }
  }
}

void FreeRun::fill_past(const Point& point, std::vector<std::vector<double>>& columns) const {
  const double h = model_.sample_time_s;
  const std::size_t n = columns[0].size();
  const auto delay = static_cast<std::size_t>(point.dead_time_s / h);
  const bool integrating = model_.process.integrating();
  const double second_s = model_.process.second_time_constant_s;
  const double keep = kept(point);
  double past = 1.0;
  for (std::size_t k = 0; k < n; ++k, past *= keep) columns[1][k] = past;
  // An integrating process goes on by what CO was off balance from the start.
  for (std::size_t k = 0; k < n; ++k) {
    const double since = k > delay ? static_cast<double>(k - delay) : 0.0;
    columns[2][k] = integrating ? 1.0 + h * since : 1.0;
  }
  if (second_s <= 0.0) {
    if (integrating) return;
    for (std::size_t k = delay + 1; k < n; ++k) columns[2][k] = keep * columns[2][k - 1];
    return;
  }
  if (integrating) {
    const double lag_keep = std::exp(-h / second_s);
    double lag = 1.0;
    for (std::size_t k = 0; k < n; ++k, lag *= lag_keep) columns[3][k] = lag;
    return;
  }
  // Two lags at rest until the other CO has passed the dead time.
  plant::ProcessParameters unit = model_.process;
  unit.gain = 1.0;
  unit.time_constant_s = point.time_constant_s;
  unit.dead_time_s = 0.0;
  plant::Process process(unit, h);
  process.reset(1.0);
  for (std::size_t k = delay + 1; k < n; ++k) columns[2][k] = process.step(0.0);
  const double other_keep = std::exp(-h / std::min(point.time_constant_s, second_s));
  double other = 1.0;
  for (std::size_t k = 0; k < n; ++k, other *= other_keep) columns[3][k] = other;
}

std::vector<double> FreeRun::with_past(const Point& point,
                                       const std::vector<std::vector<double>>& columns,
                                       const std::vector<double>& pv,
                                       const std::vector<bool>& measured,
                                       std::size_t fitted) const {
  const double memory_s =
      point.dead_time_s + 6.0 * (point.time_constant_s + model_.process.second_time_constant_s);
  const std::size_t head =
      model_.process.integrating() || fits_level()
          ? fitted
          : std::min(pv.size(), static_cast<std::size_t>(memory_s / model_.sample_time_s) + 2);
  const std::size_t count = base_columns() - 1;
  using Small = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 4, 1>;
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 4, 4>;
  const auto size = static_cast<Eigen::Index>(count);
  Small solved = Small::Zero(size);
  const auto whole = [&](std::size_t samples) {
    std::vector<double> out(samples);
    for (std::size_t k = 0; k < samples; ++k) {
      out[k] = offset_[k] + columns[0][k];
      for (std::size_t i = 0; i < count; ++i) {
        out[k] += solved(static_cast<Eigen::Index>(i)) * columns[1 + i][k];
      }
    }
    return out;
  };
  // Newton's steps, of which a PV that is shown as it is needs one.
  for (int round = 0; round < (reading_effects_.empty() ? 1 : kPastRounds); ++round) {
    std::vector<double> shown = whole(head);
    const std::vector<double> slope = slopes({}, point, shown);
    show({}, point, shown);
    Square normal = Square::Identity(size, size) * 1e-6;
    Small right = Small::Zero(size);
    Small row(size);
    for (std::size_t k = 0; k < head; ++k) {
      if (!measured[k]) continue;
      for (std::size_t i = 0; i < count; ++i) {
        row(static_cast<Eigen::Index>(i)) = slope[k] * columns[1 + i][k];
      }
      normal += row * row.transpose();
      right += row * (pv[k] - shown[k]);
    }
    solved += normal.ldlt().solve(right);
  }
  return whole(columns[0].size());
}

std::vector<double> FreeRun::flow(const Point& point, Block block) const {
  Chains c = chains({}, point);
  std::vector<double> out(co_.size());
  out[0] = c.valve.reset(co_[0], 0.0);
  const std::span<double> moves(out.data() + 1, out.size() - 1);
  std::copy_n(co_.begin(), moves.size(), moves.begin());
  c.valve.run(moves, 0.0, model_.sample_time_s);
  if (block == Block::process) {
    out[0] = c.process.reset(out[0], 0.0);
    c.process.run(moves, 0.0, model_.sample_time_s);
  }
  return out;
}

std::vector<double> FreeRun::answer(const Point& point, Block block, effects::Effect law,
                                    const std::vector<double>& flow) const {
  const double h = model_.sample_time_s;
  Chains c = chains({}, point);
  plant::Process process(process_at(point, 1.0, !c.with_dead_time), h);
  std::vector<double> out = flow;
  const std::span<double> moves(out.data() + 1, out.size() - 1);
  out[0] = law.reset(out[0]);
  law.run(moves, 0.0, h, nullptr);
  if (block == Block::valve) {
    out[0] = c.process.reset(out[0], 0.0);
    c.process.run(moves, 0.0, h);
  }
  out[0] = process.reset(out[0]);
  for (double& v : moves) v = process.step(v);
  pass_transmitter(out);
  return out;
}

double FreeRun::kept(const Point& point) const {
  if (model_.process.integrating()) return 1.0;
  return std::exp(-model_.sample_time_s /
                  std::max(point.time_constant_s, model_.process.second_time_constant_s));
}

plant::ProcessParameters FreeRun::process_at(const Point& point, double gain,
                                             bool with_dead_time) const {
  plant::ProcessParameters process = model_.process;
  process.gain *= gain;
  process.time_constant_s = point.time_constant_s;
  process.dead_time_s = with_dead_time ? point.dead_time_s : 0.0;
  return process;
}

double FreeRun::short_runs(const Terms& terms, const Point& point, const std::vector<double>& pv,
                           const std::vector<bool>& used, double gain, std::size_t run_samples,
                           double most) const {
  constexpr int kPlaces = 3;  // to each side of CO
  constexpr std::size_t kStretch =
      32;  // samples between two looks whether a place is still worth going on
  const double h = model_.sample_time_s;
  const double keep = kept(point);
  const bool integrating = model_.process.integrating();
  const auto dead = static_cast<std::size_t>(point.dead_time_s / h) + 1;
  const Chains fresh = chains(terms, point);
  plant::Process process(process_at(point, gain, !fresh.with_dead_time), h);
  const Candidate& sticking = *terms.back();
  std::vector<double> at_end = point.searched.back();
  at_end.back() = 1.0;
  const double half_band = gap::start_offset(sticking, at_end);
  double sum = 0.0;
  Chains c = fresh;
  std::array<double, kStretch> stretch{};
  for (std::size_t begin = 0; begin < co_.size() && used[begin] && sum < most;
       begin += run_samples) {
    const std::size_t end = std::min(begin + run_samples, co_.size());
    double best = std::numeric_limits<double>::infinity();
    double best_place = 0.0;
    const auto offer = [&](double place) {
      c = fresh;
      const double begin_s = static_cast<double>(begin) * h;
      double flow = c.valve.reset(co_[begin] - half_band * std::clamp(place, -1.0, 1.0), begin_s);
      flow = c.valve.step(co_[begin], begin_s);
      double at = process.reset(c.process.reset(flow, begin_s));
      // What is left of PV on what the process brought along: dying away, or a level and a ramp.
      numeric::TwoColumns rest{.aa = kTrace, .bb = kTrace};
      double level = 1.0;
      double ramp = 0.0;
      const auto take = [&](std::size_t k) {
        // Until then PV still answers to the run before.
        if (used[k] && k >= begin + dead) rest.add(level, ramp, pv[k] - at);
      };
      take(begin);
      for (std::size_t k = begin + 1; k < end;) {
        const std::size_t count = std::min(kStretch, end - k);
        const std::span<double> moves(stretch.data(), count);
        std::copy_n(co_.begin() + static_cast<std::ptrdiff_t>(k) - 1, count, moves.begin());
        const double first_s = static_cast<double>(k - 1) * h;
        c.valve.run(moves, first_s, h);
        c.process.run(moves, first_s, h);
        for (const double move : moves) {
          at = process.step(move);
          level *= keep;
          if (integrating) ramp += h;
          take(k++);
        }
        // It never falls as samples are added.
        if (!(rest.left() < best)) return;
      }
      best = rest.left();
      best_place = place;
    };
    for (int place = -kPlaces; place <= kPlaces; ++place) {
      offer(static_cast<double>(place) / kPlaces);
    }
    for (double step = 0.5 / kPlaces; step > 0.1 / kPlaces; step /= 2.0) {
      const double around = best_place;
      offer(around - step);
      offer(around + step);
    }
    sum += best;
  }
  return sum;
}

double FreeRun::start_offset(const Terms& terms, const Point& point) const {
  double offset = point.start_offset;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    offset += gap::start_offset(*terms[i], point.searched[i]);
  }
  return offset;
}

plant::LoopModel FreeRun::corrected(const Terms& terms, const Point& point,
                                    const std::vector<double>& solved) const {
  plant::LoopModel model = model_;
  model.process.time_constant_s = point.time_constant_s;
  model.process.dead_time_s = point.dead_time_s;
  const bool gain_changed =
      std::any_of(terms.begin(), terms.end(), [](const Candidate* t) { return t->solves_gain; });
  if (!gain_changed) model.process.gain *= solved[0];
  if (level_ == Level::of_record && fitted_level(solved) != 0.0) {
    model.process.level = model.process.level.value_or(0.0) + fitted_level(solved);
  }
  std::size_t next = base_columns();
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const Candidate& term = *terms[i];
    const std::vector<double> own =
        term.solves_gain
            ? std::vector<double>{solved[0]}
            : std::vector<double>(
                  solved.begin() + static_cast<std::ptrdiff_t>(next),
                  solved.begin() + static_cast<std::ptrdiff_t>(next + term.linear_columns()));
    next += term.linear_columns();
    EffectSpec spec = with_actuator(term, term.effect(point.searched[i], own), point);
    switch (term.block) {
      case Block::valve: place_in_valve(model.valve_effects, std::move(spec)); break;
      case Block::process: model.process_effects.push_back(std::move(spec)); break;
      case Block::transmitter: model.transmitter_effects.push_back(std::move(spec)); break;
      case Block::disturbance: model.disturbances.push_back(std::move(spec)); break;
      case Block::controller: break;  // no candidate: compare_controller() finds it
    }
  }
  return model;
}

}  // namespace loopwarden::gap
