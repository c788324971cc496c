// SPDX-License-Identifier: Apache-2.0
#include "model/control/supervisor.hpp"

namespace loopwarden::control {

Fault Supervisor::gravest(const Conditions& c) const noexcept {
  if (c.stop) return Fault::stop;
  if (c.enable_open) return Fault::enable_open;
  if (c.not_finite) return Fault::not_finite;
  if (c.late_cycle && started_) return Fault::late_cycle;
  // Before the first good value no control can be lost.
  if (!started_ && (c.output_lost || !c.pv_good)) return Fault::starting;
  if (c.output_lost) return Fault::output_lost;
  if (!c.pv_good) return Fault::bad_pv;
  return Fault::none;
}

OutputAction Supervisor::action() const noexcept {
  switch (fault_) {
    case Fault::stop: return settings_.on_stop;
    case Fault::enable_open: return settings_.on_enable_open;
    case Fault::not_finite: return settings_.on_not_finite;
    case Fault::late_cycle: return settings_.on_late_cycle;
    case Fault::output_lost: return settings_.on_output_lost;
    case Fault::bad_pv:
      return seconds(pv_bad_periods_) >= settings_.bad_pv_hold_s ? settings_.on_bad_pv
                                                                 : OutputAction::hold();
    case Fault::output_unknown:
    case Fault::starting:
    case Fault::none: break;
  }
  return OutputAction::hold();
}

void Supervisor::watch_pv(bool good) noexcept {
  pv_good_periods_ = good ? pv_good_periods_ + 1 : 0;
  const bool recovering =
      pv_bad_periods_ > 0 && seconds(pv_good_periods_) < settings_.recovery_delay_s;
  pv_bad_periods_ = started_ && (!good || recovering) ? pv_bad_periods_ + 1 : 0;
}

Decision Supervisor::step(const Conditions& conditions) noexcept {
  const Fault now = gravest(conditions);
  started_ = started_ || (conditions.pv_good && !conditions.output_lost);
  Decision decision;
  if (now != Fault::none) {
    fault_ = now;
    gone_periods_ = 0;
  } else if (fault_ != Fault::none) {
    ++gone_periods_;
    if (seconds(gone_periods_) >= settings_.recovery_delay_s || fault_ == Fault::starting) {
      decision.to_manual = fault_ != Fault::starting && settings_.recovery == Recovery::manual;
      fault_ = Fault::none;
    }
  }
  decision.fault = fault_;
  decision.action = action();
  watch_pv(conditions.pv_good);
  return decision;
}

Decision Supervisor::settle(Decision decision, bool output_known) noexcept {
  output_known_ = output_known;
  decision.fault = fault();
  if (!output_known && decision.fault != Fault::stop) decision.action = OutputAction::hold();
  return decision;
}

}  // namespace loopwarden::control
