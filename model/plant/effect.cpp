// SPDX-License-Identifier: Apache-2.0
#include "model/plant/effect.hpp"

namespace loopwarden::plant {
namespace {

double step_effect(Effect& effect, double in, double time_s) noexcept {
  double out = in;
  with_effect(effect, [&](auto& e) {
    if constexpr (requires { e.step(in, time_s); }) {
      out = e.step(in, time_s);
    } else {
      out = e.step(in);
    }
  });
  return out;
}

double reset_effect(Effect& effect, double in) noexcept {
  double out = in;
  with_effect(effect, [&](auto& e) { out = e.reset(in); });
  return out;
}

}  // namespace

void EffectChain::add(Effect effect, const Schedule& schedule) {
  const bool is_characteristic = std::holds_alternative<ValveCharacteristic>(effect);
  links_.push_back({std::move(effect), schedule, !schedule.always(), is_characteristic});
}

double EffectChain::reset(double in, double time_s) noexcept {
  double ignored = 0.0;
  return reset(in, time_s, ignored);
}

double EffectChain::step(double in, double time_s) noexcept {
  double ignored = 0.0;
  return step(in, time_s, ignored);
}

double EffectChain::reset(double in, double time_s, double& before_characteristic) noexcept {
  return pass(in, time_s, before_characteristic, reset_effect);
}

double EffectChain::step(double in, double time_s, double& before_characteristic) noexcept {
  return pass(in, time_s, before_characteristic,
              [time_s](Effect& effect, double u) { return step_effect(effect, u, time_s); });
}

template <class Advance>
double EffectChain::pass(double in, double time_s, double& before_characteristic,
                         Advance advance) noexcept {
  bool characteristic_met = false;
  for (Link& link : links_) {
    if (link.scheduled) {
      const double severity = link.schedule.severity(time_s);
      with_effect(link.effect, [&](auto& e) { e.set_severity(severity); });
    }
    if (link.is_characteristic && !characteristic_met) {
      before_characteristic = in;
      characteristic_met = true;
    }
    in = advance(link.effect, in);
  }
  if (!characteristic_met) before_characteristic = in;
  return in;
}

void EffectChain::run(std::span<double> signal, double first_s, double period_s) noexcept {
  for (Link& link : links_) {
    with_effect(link.effect, [&](auto& e) {
      for (std::size_t k = 0; k < signal.size(); ++k) {
        const double time_s = first_s + static_cast<double>(k) * period_s;
        if (link.scheduled) e.set_severity(link.schedule.severity(time_s));
        if constexpr (requires { e.step(signal[k], time_s); }) {
          signal[k] = e.step(signal[k], time_s);
        } else {
          signal[k] = e.step(signal[k]);
        }
      }
    });
  }
}

double EffectChain::scheduled_severity(double time_s) const noexcept {
  double severity = 0.0;
  for (const Link& link : links_) {
    if (link.scheduled) severity = std::max(severity, link.schedule.severity(time_s));
  }
  return severity;
}

}  // namespace loopwarden::plant
