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

constexpr double kStep = 1e-3;  // of ln T, for the derivative

effects::EffectChain chain_of(std::span<const EffectSpec> specs, Block block,
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

// Puts an effect of the valve at its place; it replaces one with the same name.
void place_in_valve(std::vector<EffectSpec>& valve, EffectSpec spec) {
  std::erase_if(valve, [&](const EffectSpec& s) { return s.name == spec.name; });
  const auto after = std::find_if(valve.begin(), valve.end(), [&](const EffectSpec& s) {
    return valve_rank(s) > valve_rank(spec);
  });
  valve.insert(after, std::move(spec));
}

// Adds friction and momentum of a healthy valve, unless an effect of the valve has them.
void add_healthy_valve(std::vector<EffectSpec>& valve, const Point& point) {
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

EffectSpec with_momentum(const Candidate& term, EffectSpec spec, const Point& point) {
  if (term.with_momentum == nullptr || point.actuator_frequency <= 0.0) return spec;
  return term.with_momentum(std::move(spec), point.actuator_frequency, point.actuator_damping);
}

// z of a flow through a process with this time constant and dead time.
void respond(const plant::ProcessParameters& process, std::span<const double> flow,
             double period_s, std::vector<double>& z) {
  plant::Process model(process, period_s);
  z.resize(flow.size());
  z[0] = model.reset(flow[0]);
  for (std::size_t k = 1; k < flow.size(); ++k) z[k] = model.step(flow[k]);
}

}  // namespace

LoopRun::LoopRun(const LoopFacts& loop, std::vector<double> co)
    : loop_(loop),
      context_{.sample_time_s = loop.model.sample_time_s,
               .output_low = loop.model.controller.pid.output_low,
               .output_high = loop.model.controller.pid.output_high,
               .pv_low = loop.model.transmitter.low,
               .pv_high = loop.model.transmitter.high},
      co_(std::move(co)),
      disturbances_(chain_of(loop.model.disturbances, Block::disturbance, context_)),
      transmitter_(chain_of(loop.model.transmitter_effects, Block::transmitter, context_)),
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
    const double shown =
        k == 0 ? transmitter.reset(disturbances.reset(pv, 0.0), 0.0)
               : transmitter.step(disturbances.step(pv, now_s), now_s);
    // The first call, with a signal of 0, makes the offset.
    signal[k] = shown - offset_[k];
  }
}

std::vector<EffectSpec> LoopRun::valve_of(const Hypothesis& hypothesis, const Point& point) const {
  std::vector<EffectSpec> valve = loop_.model.valve_effects;
  for (std::size_t i = 0; i < hypothesis.terms().size(); ++i) {
    const Candidate& term = *hypothesis.terms()[i];
    if (term.block != Block::valve || !term.in_path()) continue;
    place_in_valve(valve, with_momentum(term, term.effect(point.searched[i], {}), point));
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
  std::vector<EffectSpec> process_effects = loop_.model.process_effects;
  std::vector<EffectSpec> transmitter_effects;
  for (std::size_t i = 0; i < hypothesis.terms().size(); ++i) {
    const Candidate& term = *hypothesis.terms()[i];
    if (!term.in_path() || term.block == Block::valve) continue;
    (term.block == Block::process ? process_effects : transmitter_effects)
        .push_back(term.effect(point.searched[i], {}));
  }
  const effects::EffectContext context = context_at(point);
  plant::ProcessParameters process = loop_.model.process;
  process.time_constant_s = point.time_constant_s;
  process.dead_time_s = effects::takes_dead_time(process_effects) ? 0.0 : point.dead_time_s;
  return {chain_of(process_effects, Block::process, context), process,
          chain_of(transmitter_effects, Block::transmitter, context)};
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

double LoopRun::run(const Hypothesis& hypothesis, const Point& point, std::size_t samples,
                    std::span<const std::int8_t> slips, std::vector<double> (&columns)[3],
                    std::vector<double>* stem) const {
  const double h = context_.sample_time_s;
  const effects::EffectContext context = context_at(point);

  // Valve. flow[k] is driven by CO held since sample k - 1.
  const std::vector<EffectSpec> valve = valve_of(hypothesis, point);
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
  if (hypothesis.sticking() == Hypothesis::npos || slips.empty()) {
    effects::EffectChain chain = chain_of(valve, Block::valve, context);
    run_chain(chain, rest, offset);
  } else {
    const auto sticks = std::find_if(valve.begin(), valve.end(), [](const EffectSpec& s) {
      const effects::Descriptor* info = effects::find_effect(s.name);
      return info->healthy_valve != nullptr;
    });
    effects::EffectChain before = chain_of({valve.begin(), sticks}, Block::valve, context);
    effects::EffectChain after = chain_of({sticks + 1, valve.end()}, Block::valve, context);
    flow[0] = before.reset(rest, 0.0);
    before.run(moves, 0.0, h);
    const effects::StictionParameters friction{sticks->parameters.at("s"),
                                               sticks->parameters.at("j")};
    effects::StictionInertial law(
        friction, {point.actuator_frequency, point.actuator_damping}, h,
        {context.output_low, context.output_high});
    law.reset(flow[0]);
    flow[0] = law.step(co_[0]);
    // The slips were found with the dead time of the model.
    const double later_s = point.dead_time_s - loop_.model.process.dead_time_s +
                           2.0 * point.actuator_damping / point.actuator_frequency;
    penalty = follow_slips(law, friction.static_friction(), slips,
                           static_cast<std::ptrdiff_t>(std::lround(later_s / h)), moves);
    flow[0] = after.reset(flow[0], 0.0);
    after.run(moves, 0.0, h);
  }
  if (stem != nullptr) *stem = flow;
  Behind behind = this->behind(hypothesis, point);
  if (!behind.process.empty()) {
    flow[0] = behind.process.reset(flow[0], 0.0);
    behind.process.run(moves, 0.0, h);
  }

  // Process, with the derivatives by differences of its own response. A later response is the same
  // one, a sample later.
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
  for (auto& column : columns) {
    pass_transmitter(column);
    if (behind.transmitter.empty()) continue;
    effects::EffectChain chain = behind.transmitter;
    column[0] = chain.reset(column[0], 0.0);
    chain.run(std::span<double>(column).subspan(1), h, h);
  }
  return penalty;
}

void LoopRun::solved(const Hypothesis& hypothesis, const Point& point, std::size_t term,
                     std::size_t samples, std::vector<std::vector<double>>& columns) const {
  const Candidate& candidate = *hypothesis.terms()[term];
  columns.resize(candidate.columns);
  for (auto& column : columns) column.assign(samples, 1.0);
  if (candidate.fill != nullptr) {
    candidate.fill(point.searched[term], context_.sample_time_s, columns);
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
  for (std::size_t i = 0; i < hypothesis.terms().size(); ++i) {
    const Candidate& term = *hypothesis.terms()[i];
    EffectSpec spec = with_momentum(term, term.effect(point.searched[i], solved[i]), point);
    switch (term.block) {
      case Block::valve: place_in_valve(model.valve_effects, std::move(spec)); break;
      case Block::process: model.process_effects.push_back(std::move(spec)); break;
      case Block::transmitter: model.transmitter_effects.push_back(std::move(spec)); break;
      case Block::disturbance: model.disturbances.push_back(std::move(spec)); break;
      case Block::controller: break;
    }
  }
  return model;
}

}  // namespace loopwarden::estimator
