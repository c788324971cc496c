// SPDX-License-Identifier: Apache-2.0
#include "daemon/loops/event_text.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace loopwarden::daemon {
namespace {

std::string output_text(double output, const config::LoopConfig& loop) {
  return std::isfinite(output) ? fmt::format("output at {:.4g} {}", output, loop.co_unit)
                               : std::string("output not known");
}

EventText fault_text(const rt::Event& event, const config::LoopConfig& loop) {
  const auto fault = static_cast<control::Fault>(event.a);
  const auto reason = static_cast<hal::Reason>(event.b);
  if (fault == control::Fault::none) {
    return {Severity::info, fmt::format("fault over; {}", output_text(event.value, loop))};
  }
  if (fault == control::Fault::output_unknown && config::is_watched(loop.io)) {
    return {Severity::warning,
            fmt::format("fault: output unknown; CO is not known ({})", to_text(reason))};
  }
  if (fault == control::Fault::output_unknown) {
    return {Severity::warning,
            "fault: output unknown; the output is not written until a read-back or a command gives "
            "its position"};
  }
  const bool about_pv = fault == control::Fault::bad_pv || fault == control::Fault::starting;
  return {
      fault == control::Fault::stop || fault == control::Fault::starting ? Severity::info
                                                                         : Severity::warning,
      fmt::format("fault: {}{}; {}", control::to_text(fault),
                  about_pv && reason != hal::Reason::none ? fmt::format(" ({})", to_text(reason))
                                                          : std::string(),
                  output_text(event.value, loop))};
}

}  // namespace

EventText describe(const rt::Event& event, const config::LoopConfig& loop) {
  switch (event.code) {
    case rt::EventCode::fault_changed: return fault_text(event, loop);
    case rt::EventCode::mode_changed:
      return {Severity::info,
              fmt::format("mode {}; {}", control::to_text(static_cast<control::Mode>(event.a)),
                          output_text(event.value, loop))};
    case rt::EventCode::settings_applied: return {Severity::info, "new settings applied"};
    case rt::EventCode::settings_wait:
      return {Severity::warning,
              fmt::format("new settings wait until CO is inside their limits; {}",
                          output_text(event.value, loop))};
    case rt::EventCode::command_refused:
      return {Severity::warning,
              fmt::format("order refused: {}", rt::to_text(static_cast<rt::Refusal>(event.a)))};
    case rt::EventCode::result_not_finite:
      return {Severity::error, "the controller's result was not a valid output; not written"};
    case rt::EventCode::jacket_stands_back:
      return {Severity::warning,
              fmt::format("jacket disengages: mean error {:.3g} {}", event.value, loop.pv_unit)};
    case rt::EventCode::jacket_resumes:
      return {Severity::info,
              fmt::format("jacket resumes: mean error {:.3g} {}", event.value, loop.pv_unit)};
    case rt::EventCode::cycle_missed:
      return {Severity::warning,
              fmt::format("{} cycle{} missed", event.a, event.a == 1 ? "" : "s")};
    case rt::EventCode::moves_disengaged:
      return {Severity::warning,
              fmt::format("planned moves disengaged: {}",
                          control::to_text(static_cast<control::DisengageReason>(event.a)))};
  }
  return {Severity::error, "unknown event"};
}

}  // namespace loopwarden::daemon
