// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/loop_run.hpp"

#include <algorithm>
#include <cmath>

#include "model/effects/stiction/stiction_inertial.hpp"
#include "model/estimator/constants.hpp"
#include "model/estimator/slips.hpp"

namespace loopwarden::estimator {
namespace {

using effects::Block;
using effects::EffectSpec;

constexpr double kStep = 1e-3;       // of ln T, for the derivative
constexpr double kShownStep = 0.02;  // of ln T, through effects that need not be linear

int valve_rank(const EffectSpec& spec) {
  const effects::Descriptor* info = effects::find_effect(spec.name);
  return info != nullptr ? info->valve_rank : effects::Descriptor{}.valve_rank;
}

EffectSpec with_momentum(const Law& term, EffectSpec spec, const Point& point) {
  if (term.with_momentum == nullptr || point.actuator_frequency <= 0.0) return spec;
  return term.with_momentum(std::move(spec), point.actuator_frequency, point.actuator_damping);
}

// z of a flow through a process with this time constant and dead time.
void respond(const plant::ProcessParameters& process, std::span<const double> flow, double period_s,
             std::vector<double>& z) {
  plant::Process model(process, period_s);
  z.resize(flow.size());
  z[0] = model.reset(flow[0]);
  for (std::size_t k = 1; k < flow.size(); ++k) z[k] = model.step(flow[k]);
}

}  // namespace

std::vector<LoopRun::Placed> LoopRun::always(const std::vector<EffectSpec>& specs) {
  std::vector<Placed> out;
  for (const EffectSpec& spec : specs) out.push_back({spec, {}});
  return out;
}

// A law acts in its own way wherever it is placed, so its own first block is the one to check.
effects::EffectChain LoopRun::chain_of(std::span<const Placed> placed,
                                       const effects::EffectContext& context) {
  effects::EffectChain chain;
  for (const auto& [spec, schedule] : placed) {
    const effects::Descriptor* info = effects::find_effect(spec.name);
    if (info == nullptr || info->is_noise) continue;
    effects::check_effect(spec, info->blocks.front(), context);
    chain.add(effects::make_effect(spec, context), schedule);
  }
  return chain;
}

// Puts an effect of the valve at its place; it replaces one with the same name.
void LoopRun::place_in_valve(std::vector<Placed>& valve, Placed placed) {
  std::erase_if(valve, [&](const Placed& p) { return p.spec.name == placed.spec.name; });
  const auto after = std::find_if(valve.begin(), valve.end(), [&](const Placed& p) {
    return valve_rank(p.spec) > valve_rank(placed.spec);
  });
  valve.insert(after, std::move(placed));
}

// Adds friction and momentum of a healthy valve, unless an effect of the valve has them.
void LoopRun::add_healthy_valve(std::vector<Placed>& valve, const Point& point) {
  if (point.actuator_frequency <= 0.0) return;
  for (const Placed& placed : valve) {
    const effects::Descriptor* info = effects::find_effect(placed.spec.name);
    if (info != nullptr && info->healthy_valve != nullptr) return;
  }
  for (const effects::Descriptor& info : effects::effect_catalogue()) {
    if (info.healthy_valve == nullptr) continue;
    place_in_valve(
        valve,
        {info.healthy_valve(point.friction, point.actuator_frequency, point.actuator_damping), {}});
  }
}

LoopRun::LoopRun(const LoopFacts& loop, std::vector<double> co)
    : loop_(loop),
      context_{.sample_time_s = loop.model.sample_time_s,
               .output_low = loop.model.controller.pid.output_low,
               .output_high = loop.model.controller.pid.output_high,
               .pv_low = loop.model.transmitter.low,
               .pv_high = loop.model.transmitter.high},
      co_(std::move(co)),
      disturbances_(chain_of(always(loop.model.disturbances), context_)),
      transmitter_(chain_of(always(loop.model.transmitter_effects), context_)),
      plain_(disturbances_.empty() && transmitter_.empty()) {
  const plant::ProcessParameters& process = loop.model.process;
  const double h = loop.model.sample_time_s;
  offset_.assign(co_.size(), 0.0);
  pass_transmitter(offset_);
  const double level = process.level.value_or(0.0);
  if (plain_) std::fill(offset_.begin(), offset_.end(), level);
  fixed_.emplace_back(co_.size(), 1.0);
  const auto decay = [&](double time_constant_s) {
    std::vector<double>& column = fixed_.emplace_back(co_.size());
    for (std::size_t k = 0; k < column.size(); ++k) {
      column[k] = std::exp(-static_cast<double>(k) * h / time_constant_s);
    }
  };
  if (process.integrating()) {
    std::vector<double>& ramp = fixed_.emplace_back(co_.size());
    for (std::size_t k = 0; k < ramp.size(); ++k) {
      ramp[k] = static_cast<double>(k) / static_cast<double>(ramp.size());
    }
  } else {
    decay(process.time_constant_s);
  }
  if (process.second_time_constant_s > 0.0) decay(process.second_time_constant_s);
}

void LoopRun::pass_transmitter(std::span<double> signal) const {
  if (plain_) return;
  effects::EffectChain disturbances = disturbances_;
  effects::EffectChain transmitter = transmitter_;
  const double level = loop_.model.process.level.value_or(0.0);
  for (std::size_t k = 0; k < signal.size(); ++k) {
    const double now_s = static_cast<double>(k) * context_.sample_time_s;
    const double pv = level + signal[k];
    const double shown = k == 0 ? transmitter.reset(disturbances.reset(pv, 0.0), 0.0)
                                : transmitter.step(disturbances.step(pv, now_s), now_s);
    // The first call, with a signal of 0, makes the offset.
    signal[k] = shown - offset_[k];
  }
}

std::size_t LoopRun::sample_at(double time_s) const noexcept {
  return time_s > 0.0 ? static_cast<std::size_t>(std::lround(time_s / context_.sample_time_s)) : 0;
}

std::vector<LoopRun::Placed> LoopRun::valve_of(const Hypothesis& hypothesis,
                                               const Point& point) const {
  std::vector<Placed> valve = always(loop_.model.valve_effects);
  for (std::size_t i = 0; i < hypothesis.terms().size(); ++i) {
    const Law& term = *hypothesis.terms()[i];
    if (term.block != Block::valve || !term.in_path()) continue;
    place_in_valve(valve, {with_momentum(term, term.effect(point.searched[i], {}), point),
                           point.schedules[i]});
  }
  add_healthy_valve(valve, point);
  return valve;
}

effects::EffectContext LoopRun::context_at(const Point& point) const {
  effects::EffectContext context = context_;
  context.dead_time_s = point.dead_time_s;
  context.time_constant_s = point.time_constant_s;
  return context;
}

LoopRun::Behind LoopRun::behind(const Hypothesis& hypothesis, const Point& point) const {
  std::vector<Placed> process_effects = always(loop_.model.process_effects);
  std::vector<Placed> transmitter_effects;
  bool takes_dead_time = effects::takes_dead_time(loop_.model.process_effects);
  for (std::size_t i = 0; i < hypothesis.terms().size(); ++i) {
    const Law& term = *hypothesis.terms()[i];
    if (!term.in_path() || term.block == Block::valve) continue;
    EffectSpec spec = term.effect(point.searched[i], {});
    takes_dead_time = takes_dead_time || effects::takes_dead_time({spec});
    (term.block == Block::process ? process_effects : transmitter_effects)
        .push_back({std::move(spec), point.schedules[i]});
  }
  effects::EffectContext context = context_at(point);
  plant::ProcessParameters process = loop_.model.process;
  process.time_constant_s = point.time_constant_s;
  process.dead_time_s = takes_dead_time ? 0.0 : point.dead_time_s;
  effects::EffectChain in_process = chain_of(process_effects, context);
  // In the transmitter a law of the valve acts on the range of PV.
  context.output_low = context.pv_low;
  context.output_high = context.pv_high;
  return {std::move(in_process), process, chain_of(transmitter_effects, context)};
}

std::vector<double> LoopRun::response(const Hypothesis& hypothesis, const Point& point,
                                      std::vector<double> flow) const {
  const double h = context_.sample_time_s;
  Behind behind = this->behind(hypothesis, point);
  if (!behind.process.empty()) {
    flow[0] = behind.process.reset(flow[0], 0.0);
    behind.process.run(std::span<double>(flow).subspan(1), 0.0, h);
  }
  respond(behind.parameters, flow, h, flow);
  pass_transmitter(flow);
  return flow;
}

// Passes z through effects that need not be linear, and takes the derivatives by differences.
void LoopRun::show(const effects::EffectChain& chain, std::vector<double> (&columns)[3]) const {
  const double h = context_.sample_time_s;
  const auto shown = [&](std::vector<double> signal) {
    effects::EffectChain own = chain;
    signal[0] = own.reset(signal[0], 0.0);
    own.run(std::span<double>(signal).subspan(1), h, h);
    return signal;
  };
  const std::vector<double> z = columns[Columns::kGain];
  columns[Columns::kGain] = shown(z);
  for (const std::size_t i : {Columns::kLag, Columns::kDeadTime}) {
    const double step = i == Columns::kLag ? kShownStep : h;
    std::vector<double> moved = z;
    for (std::size_t k = 0; k < z.size(); ++k) moved[k] += step * columns[i][k];
    columns[i] = shown(std::move(moved));
    for (std::size_t k = 0; k < z.size(); ++k) {
      columns[i][k] = (columns[i][k] - columns[Columns::kGain][k]) / step;
    }
  }
}

double LoopRun::run(const Hypothesis& hypothesis, const Point& point, std::size_t samples,
                    const Slips* slips, std::vector<double> (&columns)[3],
                    std::vector<double>* stem) const {
  const double h = context_.sample_time_s;
  const effects::EffectContext context = context_at(point);

  // Valve. flow[k] is driven by CO held since sample k - 1.
  const std::vector<Placed> valve = valve_of(hypothesis, point);
  std::vector<double>& flow = columns[0];
  flow.resize(samples);
  const std::span<double> moves(flow.data() + 1, samples - 1);
  std::copy_n(co_.begin(), samples - 1, moves.begin());
  const double rest = co_[0] - point.start_offset;
  double penalty = 0.0;
  const auto run_chain = [&](effects::EffectChain& chain, double first, bool offset) {
    flow[0] = chain.reset(first, 0.0);
    if (offset) flow[0] = chain.step(co_[0], 0.0);
    chain.run(moves, 0.0, h);
  };
  const bool offset = point.start_offset != 0.0;
  if (hypothesis.sticking() == Hypothesis::npos || slips == nullptr) {
    effects::EffectChain chain = chain_of(valve, context);
    run_chain(chain, rest, offset);
  } else {
    const auto sticks = std::find_if(valve.begin(), valve.end(), [](const Placed& p) {
      const effects::Descriptor* info = effects::find_effect(p.spec.name);
      return info->healthy_valve != nullptr;
    });
    effects::EffectChain before = chain_of({valve.begin(), sticks}, context);
    effects::EffectChain after = chain_of({sticks + 1, valve.end()}, context);
    flow[0] = before.reset(rest, 0.0);
    before.run(moves, 0.0, h);
    const effects::StictionParameters friction{sticks->spec.parameters.at("s"),
                                               sticks->spec.parameters.at("j")};
    effects::StictionInertial law(friction, {point.actuator_frequency, point.actuator_damping}, h,
                                  {context.output_low, context.output_high});
    law.reset(flow[0]);
    flow[0] = law.step(co_[0]);
    // Until it begins, the stem follows its force.
    const std::size_t first = std::min(moves.size(), sample_at(sticks->schedule.from_s));
    if (first > 0) {
      law.reset(moves[first - 1]);
    }
    // The slips were found with the dead time of the model.
    const double later_s = point.dead_time_s - loop_.model.process.dead_time_s +
                           2.0 * point.actuator_damping / point.actuator_frequency;
    penalty = follow_slips(
        law, friction.static_friction(), *slips,
        static_cast<std::ptrdiff_t>(std::lround(later_s / h)) + static_cast<std::ptrdiff_t>(first),
        moves.subspan(first));
    flow[0] = after.reset(flow[0], 0.0);
    after.run(moves, 0.0, h);
  }
  if (stem != nullptr) *stem = flow;
  Behind behind = this->behind(hypothesis, point);
  if (!behind.process.empty()) {
    flow[0] = behind.process.reset(flow[0], 0.0);
    behind.process.run(moves, 0.0, h);
  }

  // Process, with the derivatives by differences of its own response. A response with
  // more dead time is the same signal, one sample later.
  const plant::ProcessParameters& process = behind.parameters;
  plant::ProcessParameters slower = process;
  slower.time_constant_s *= 1.0 + kStep;
  respond(slower, flow, h, columns[Columns::kLag]);
  respond(process, flow, h, flow);
  const std::vector<double>& z = columns[Columns::kGain];
  std::vector<double>& later = columns[Columns::kDeadTime];
  later.resize(samples);
  later[0] = 0.0;
  columns[Columns::kLag][0] = 0.0;
  for (std::size_t k = 1; k < samples; ++k) {
    columns[Columns::kLag][k] = (columns[Columns::kLag][k] - z[k]) / kStep;
    later[k] = (z[k - 1] - z[k]) / h;
  }
  if (!behind.transmitter.empty()) show(behind.transmitter, columns);
  for (auto& column : columns) pass_transmitter(column);
  return penalty;
}

void LoopRun::solved(const Hypothesis& hypothesis, const Point& point, std::size_t term,
                     std::size_t samples, std::vector<std::vector<double>>& columns) const {
  const Law& candidate = *hypothesis.terms()[term];
  columns.resize(candidate.columns);
  for (auto& column : columns) column.assign(samples, 1.0);
  if (candidate.fill != nullptr) {
    candidate.fill(point.searched[term], context_.sample_time_s, columns);
  }
  if (candidate.timing == Law::Timing::since) {
    const std::size_t first = std::min(samples, sample_at(point.schedules[term].from_s));
    for (auto& column : columns) {
      std::copy_backward(column.begin(), column.end() - static_cast<std::ptrdiff_t>(first),
                         column.end());
      std::fill_n(column.begin(), first, 0.0);
    }
  }
  if (candidate.block != Block::disturbance) return;
  for (auto& column : columns) pass_transmitter(column);
}

plant::LoopModel LoopRun::corrected(const Hypothesis& hypothesis, const Point& point, double gain,
                                    double level,
                                    const std::vector<std::vector<double>>& solved) const {
  plant::LoopModel model = loop_.model;
  model.process.time_constant_s = point.time_constant_s;
  model.process.dead_time_s = point.dead_time_s;
  if (!hypothesis.changes_gain()) model.process.gain *= gain;
  if (!model.process.integrating()) {
    model.process.level = model.process.level.value_or(0.0) + level;
  }
  std::vector<Placed> valve = always(model.valve_effects);
  for (std::size_t i = 0; i < hypothesis.terms().size(); ++i) {
    const Law& term = *hypothesis.terms()[i];
    EffectSpec spec = with_momentum(term, term.effect(point.searched[i], solved[i]), point);
    switch (term.block) {
      case Block::valve: place_in_valve(valve, {std::move(spec), {}}); break;
      case Block::process: model.process_effects.push_back(std::move(spec)); break;
      case Block::transmitter: model.transmitter_effects.push_back(std::move(spec)); break;
      case Block::disturbance: model.disturbances.push_back(std::move(spec)); break;
      case Block::controller: break;
    }
  }
  model.valve_effects.clear();
  for (Placed& placed : valve) model.valve_effects.push_back(std::move(placed.spec));
  return model;
}

}  // namespace loopwarden::estimator
