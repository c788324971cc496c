// SPDX-License-Identifier: Apache-2.0
#include "model/plant/plant.hpp"

#include <algorithm>
#include <utility>

#include "model/effects/catalogue.hpp"

namespace loopwarden::plant {
namespace {

ProcessParameters process_of(const LoopModel& model) {
  ProcessParameters process = model.process;
  std::vector<effects::EffectSpec> all = model.process_effects;
  for (const ScheduledFault& fault : model.scenario.faults) all.push_back(fault.effect);
  if (effects::takes_dead_time(all)) process.dead_time_s = 0.0;
  return process;
}

double rest_level(const LoopModel& model) {
  if (!model.process.integrating()) return model.process.level.value_or(0.0);
  return model.scenario.set_point.empty() ? (model.transmitter.low + model.transmitter.high) / 2.0
                                          : model.scenario.set_point.front().second;
}

}  // namespace

Plant::Plant(const LoopModel& model, std::uint64_t seed)
    : sample_time_s_(model.sample_time_s),
      output_low_(model.controller.pid.output_low),
      output_high_(model.controller.pid.output_high),
      process_(process_of(model), model.sample_time_s),
      integrating_(model.process.integrating()),
      level_(rest_level(model)),
      transmitter_(model.transmitter, seed) {
  effects::EffectContext context{.sample_time_s = model.sample_time_s,
                                 .output_low = output_low_,
                                 .output_high = output_high_,
                                 .pv_low = model.transmitter.low,
                                 .pv_high = model.transmitter.high,
                                 .seed = seed,
                                 .time_constant_s = model.process.time_constant_s,
                                 .dead_time_s = model.process.dead_time_s};
  const auto add = [&](effects::EffectChain& chain, effects::Block block, effects::EffectSpec spec,
                       const effects::Schedule& schedule) {
    ++context.seed;  // each random effect has a separate stream
    effects::complete(spec, context);
    effects::check_effect(spec, block, context);
    effects::Effect effect = effects::make_effect(spec, context);
    effects::EffectChain& place = effect.acts_on_reading() ? reading_effects_ : chain;
    place.add(std::move(effect), schedule);
  };
  for (const effects::EffectSpec& spec : model.valve_effects)
    add(valve_, effects::Block::valve, spec, {});
  for (const effects::EffectSpec& spec : model.process_effects)
    add(process_effects_, effects::Block::process, spec, {});
  for (const effects::EffectSpec& spec : model.transmitter_effects) {
    add(transmitter_effects_, effects::Block::transmitter, spec, {});
  }
  for (const effects::EffectSpec& spec : model.disturbances)
    add(disturbances_, effects::Block::disturbance, spec, {});
  for (const ScheduledFault& fault : model.scenario.faults) {
    effects::EffectChain& chain = fault.block == effects::Block::valve     ? valve_
                                  : fault.block == effects::Block::process ? process_effects_
                                  : fault.block == effects::Block::transmitter
                                      ? transmitter_effects_
                                      : disturbances_;
    add(chain, fault.block, fault.effect, fault.schedule);
  }
  reset(output_low_);
}

void Plant::reset(double co) noexcept {
  samples_ = 0;
  double flow = valve_.reset(co, 0.0, stem_);
  flow = process_effects_.reset(flow, 0.0);
  const double pv = disturbances_.reset(process_.reset(flow, level_), 0.0);
  true_pv_ = pv;
  pv_ = reading_effects_.reset(transmitter_.step(transmitter_effects_.reset(pv, 0.0)), 0.0);
}

double Plant::output_for(double pv) const {
  if (integrating_) return (output_low_ + output_high_) / 2.0;
  Plant probe(*this);
  const auto rest_pv = [&](double co) {
    probe.reset(co);
    return probe.true_pv_;
  };
  double low = output_low_;
  double high = output_high_;
  const bool rising = rest_pv(high) >= rest_pv(low);
  for (int i = 0; i < 60; ++i) {  // 60 halvings make the span smaller than any resolution
    const double middle = (low + high) / 2.0;
    ((rest_pv(middle) < pv) == rising ? low : high) = middle;
  }
  return (low + high) / 2.0;
}

double Plant::step(double co) noexcept {
  const double held_from_s = time_s();
  const double flow = valve_.step(co, held_from_s, stem_);
  const double driving = process_effects_.step(flow, held_from_s);
  ++samples_;
  const double now_s = time_s();
  true_pv_ = disturbances_.step(process_.step(driving), now_s);
  const double reading = transmitter_.step(transmitter_effects_.step(true_pv_, now_s));
  pv_ = reading_effects_.step(reading, now_s);
  return pv_;
}

double Plant::fault_severity() const noexcept {
  const double now_s = time_s();
  return std::max({valve_.scheduled_severity(now_s), process_effects_.scheduled_severity(now_s),
                   transmitter_effects_.scheduled_severity(now_s),
                   reading_effects_.scheduled_severity(now_s),
                   disturbances_.scheduled_severity(now_s)});
}

}  // namespace loopwarden::plant
