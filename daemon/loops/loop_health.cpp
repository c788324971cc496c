// SPDX-License-Identifier: Apache-2.0
#include "daemon/loops/loop_health.hpp"

#include "config/interlocks.hpp"
#include "hal/contract/sample.hpp"
#include "model/control/supervisor.hpp"

namespace loopwarden::daemon {

bool is_simulated(const config::LoopConfig& config) noexcept {
  return !config::backing_of(config.io).hardware;
}

alarm::Ne107 health_of(const config::LoopConfig& config, const record::RecordRow& row,
                       const supervision::AlarmSnapshot& watch, double severe_percent) noexcept {
  using control::Fault;
  const auto fault = static_cast<Fault>(row.fault);
  const auto quality = static_cast<hal::Quality>(row.pv_quality);
  const bool by_hand = static_cast<control::Mode>(row.requested_mode) == control::Mode::manual ||
                       fault == Fault::enable_open || fault == Fault::stop ||
                       fault == Fault::output_unknown;
  return condensed({.failed = quality == hal::Quality::bad || fault == Fault::bad_pv ||
                              fault == Fault::output_lost || fault == Fault::not_finite ||
                              fault == Fault::late_cycle,
                    .simulated = is_simulated(config),
                    .manual = by_hand,
                    .pv_uncertain = quality == hal::Quality::uncertain},
                   watch.alarms, severe_percent);
}

}  // namespace loopwarden::daemon
