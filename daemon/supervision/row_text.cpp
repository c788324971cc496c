// SPDX-License-Identifier: Apache-2.0
#include "daemon/supervision/row_text.hpp"

#include <fmt/format.h>

namespace loopwarden::daemon::supervision {

using record::RecordRow;

namespace {

std::string pv_text(const RecordRow& row) {
  std::string text = fmt::format("PV is {}", to_text(row.pv_quality));
  if (row.pv_quality == base::Quality::good) return text;
  return text + fmt::format(": {}", to_text(row.pv_reason));
}

std::string mode_text(const RecordRow& row, alarm::NormalMode normal) {
  std::string text = to_text(row.mode);
  if (row.fault != control::Fault::none) text += fmt::format(" ({})", to_text(row.fault));
  return text + fmt::format("; the normal mode is {}", to_text(normal));
}

// Returns PV, its limit and the unit.
std::string limit_text(const alarm::ProcessChange& change, const RecordRow& row,
                       const alarm::LimitSettings& limits, const std::string& unit) {
  const double limit = limits.at(change.kind).limit;
  if (change.kind == alarm::AlarmKind::rate_of_change) {
    return fmt::format("PV {:.4g} {} changes {} than {:.4g} {}/s", row.pv, unit,
                       change.on ? "faster" : "no faster", limit, unit);
  }
  if (change.kind == alarm::AlarmKind::deviation) {
    return fmt::format("PV {:.4g}, SP {:.4g}, limit {:.4g} {}", row.pv, row.sp, limit, unit);
  }
  return fmt::format("PV {:.4g}, limit {:.4g} {}", row.pv, limit, unit);
}

}  // namespace

std::string why_changed(const alarm::ProcessChange& change, const RecordRow& row,
                        const alarm::ProcessSettings& settings, const std::string& unit) {
  const bool pv_bad = row.pv_quality == base::Quality::bad;
  switch (change.kind) {
    case alarm::AlarmKind::output_lost:
      if (!change.on) return "commands reach the device";
      return "commands don't reach the device" + (pv_bad ? "; " + pv_text(row) : std::string());
    case alarm::AlarmKind::output_unknown:
      return change.on ? "output position unknown" : "output position known";
    case alarm::AlarmKind::not_normal_mode: return mode_text(row, settings.normal_mode);
    case alarm::AlarmKind::enable_open:
      return change.on ? "the enable contact is open" : "the enable contact is closed";
    case alarm::AlarmKind::bad_pv:
    case alarm::AlarmKind::source_lost: break;
    default: return limit_text(change, row, settings.limits, unit);
  }
  return pv_text(row);
}

}  // namespace loopwarden::daemon::supervision
