// SPDX-License-Identifier: Apache-2.0
#include "model/effects/effect.hpp"

namespace loopwarden::effects {

void EffectChain::add(Effect effect, const Schedule& schedule) {
  const bool acts_on_flow = effect.acts_on_flow();
  links_.push_back({std::move(effect), schedule, !schedule.always(), acts_on_flow});
}

double EffectChain::reset(double in, double time_s) noexcept {
  double ignored = 0.0;
  return reset(in, time_s, ignored);
}

double EffectChain::step(double in, double time_s) noexcept {
  double ignored = 0.0;
  return step(in, time_s, ignored);
}

double EffectChain::reset(double in, double time_s, double& travel) noexcept {
  return pass(in, time_s, travel, [](Effect& effect, double u) { return effect.reset(u); });
}

double EffectChain::step(double in, double time_s, double& travel) noexcept {
  return pass(in, time_s, travel,
              [time_s](Effect& effect, double u) { return effect.step(u, time_s); });
}

template <class Advance>
double EffectChain::pass(double in, double time_s, double& travel, Advance advance) noexcept {
  bool flows = false;
  for (Link& link : links_) {
    if (link.scheduled) link.effect.set_severity(link.schedule.severity(time_s));
    if (link.acts_on_flow && !flows) {
      travel = in;
      flows = true;
    }
    in = advance(link.effect, in);
  }
  if (!flows) travel = in;
  return in;
}

void EffectChain::run(std::span<double> signal, double first_s, double period_s) noexcept {
  for (Link& link : links_) {
    link.effect.run(signal, first_s, period_s, link.scheduled ? &link.schedule : nullptr);
  }
}

double EffectChain::scheduled_severity(double time_s) const noexcept {
  double severity = 0.0;
  for (const Link& link : links_) {
    if (link.scheduled) severity = std::max(severity, link.schedule.severity(time_s));
  }
  return severity;
}

}  // namespace loopwarden::effects
