// SPDX-License-Identifier: Apache-2.0
#include "daemon/loops/loop_health.hpp"

#include "config/interlocks.hpp"

namespace loopwarden::daemon {

bool is_simulated(const config::LoopConfig& config) noexcept {
  return !config::backing_of(config.io).hardware;
}

alarm::Ne107 health_of(const config::LoopConfig& config, const record::RecordRow& row,
                       const supervision::AlarmSnapshot& watch, double severe_percent) noexcept {
  using control::Fault;
  const Fault fault = row.fault;
  const bool by_hand = row.requested_mode == control::Mode::manual || fault == Fault::enable_open ||
                       fault == Fault::stop || fault == Fault::output_unknown;
  return condensed({.failed = row.pv_quality == base::Quality::bad || fault == Fault::bad_pv ||
                              fault == Fault::output_lost || fault == Fault::not_finite ||
                              fault == Fault::late_cycle,
                    .simulated = is_simulated(config),
                    .manual = by_hand,
                    .pv_uncertain = row.pv_quality == base::Quality::uncertain},
                   watch.alarms, severe_percent);
}

}  // namespace loopwarden::daemon
