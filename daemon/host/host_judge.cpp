// SPDX-License-Identifier: Apache-2.0
#include "daemon/host/host_judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace loopwarden::daemon::host {

using alarm::BoxAlarm;
using alarm::index_of;

namespace {

std::string names(const std::vector<std::string>& all) {
  return fmt::format("{}", fmt::join(all, ", "));
}

// Returns "opcua (FIC-101, FIC-102 and 6 more loops)", for example.
std::string connections_text(const std::vector<LostConnection>& all) {
  constexpr std::size_t kNamed = 8;
  std::string text;
  for (const LostConnection& one : all) {
    if (!text.empty()) text += "; ";
    text += one.what;
    const std::size_t named = std::min(one.loops.size(), kNamed);
    if (named == 0) continue;
    text += fmt::format(
        ": {}",
        fmt::join(one.loops.begin(), one.loops.begin() + static_cast<std::ptrdiff_t>(named), ", "));
    if (one.loops.size() > named)
      text += fmt::format(" and {} more loops", one.loops.size() - named);
  }
  return text;
}

void judge_disk(const BoxLook& look, std::optional<bool>& found, std::string& why) {
  if (!look.journal_error.empty()) {
    found = true;
    why = "the journal can't write: " + look.journal_error;
  } else if (look.disk_wait_s >= kDiskHangs_s) {
    found = true;
    why = fmt::format("the disk has not answered for {:.0f} s", look.disk_wait_s);
  } else if (look.disk && look.disk->room_bytes) {
    found = *look.disk->room_bytes < kLeastRoom_bytes;
    if (*found) why = fmt::format("{} MB are left", *look.disk->room_bytes / 1'000'000);
  }
}

void judge_certificates(const BoxLook& look, std::optional<bool>& found, std::string& why) {
  if (!look.disk) return;
  std::vector<std::string> ending;
  for (const Certificate& one : look.disk->certificates) {
    if (!one.ends_s) {
      ending.push_back(one.file + " can't be read");
      continue;
    }
    const std::int64_t remaining_s = *one.ends_s - look.utc_ms / 1000;
    const double days = static_cast<double>(remaining_s) / (24.0 * 3600.0);
    if (days >= kCertificate_days) continue;
    ending.push_back(days < 0.0
                         ? one.file + " has ended"
                         : fmt::format("{} ends in {:.0f} days", one.file, std::floor(days)));
  }
  found = !ending.empty();
  why = names(ending);
}

}  // namespace

void HostJudge::judge_services(const BoxLook& look, std::optional<bool>& found, std::string& why) {
  if (look.failed_services && !look.failed_services->empty()) {
    failed_at_ms_ = look.monotonic_ms;
    failed_ = *look.failed_services;
  } else if (look.monotonic_ms - failed_at_ms_ >= kFailedAgain_ms) {
    failed_.clear();
  }
  std::vector<std::string> all = failed_;
  if (!look.failed_services && look.has_services) {
    all.emplace_back(
        "the state of the services is not known, because the system bus does not answer: "
        "install the package dbus, then run systemctl start dbus.socket");
  }
  all.insert(all.end(), look.failed_parts.begin(), look.failed_parts.end());
  found = !all.empty();
  why = names(all);
}

BoxReport HostJudge::judge(const BoxLook& look) {
  BoxReport report;
  const auto found = [&](BoxAlarm kind) -> std::optional<bool>& {
    return report.found[index_of(kind)];
  };
  const auto why = [&](BoxAlarm kind) -> std::string& { return report.why[index_of(kind)]; };
  const auto within = [&](const std::optional<std::int64_t>& at_ms) {
    return at_ms && look.monotonic_ms - *at_ms < kRemembered_ms;
  };
  judge_disk(look, found(BoxAlarm::disk_full), why(BoxAlarm::disk_full));

  const std::int64_t offset_ms = look.utc_ms - look.monotonic_ms;
  if (offset_ms_ && std::abs(offset_ms - *offset_ms_) > kClockStep_ms) {
    stepped_at_ms_ = look.monotonic_ms;
    step_ms_ = offset_ms - *offset_ms_;
  }
  offset_ms_ = offset_ms;
  found(BoxAlarm::clock_stepped) = within(stepped_at_ms_);
  if (within(stepped_at_ms_)) {
    why(BoxAlarm::clock_stepped) =
        fmt::format("the clock was set by {:+.1f} s", static_cast<double>(step_ms_) / 1000.0);
  }

  found(BoxAlarm::feeder_lost) = !look.lost_feeders.empty();
  why(BoxAlarm::feeder_lost) = connections_text(look.lost_feeders);
  found(BoxAlarm::connection_lost) = !look.lost_connections.empty();
  why(BoxAlarm::connection_lost) = connections_text(look.lost_connections);
  for (const LostConnection& one : look.lost_connections) {
    report.lost_connections.push_back(one.what);
    report.output_behind = report.output_behind || one.controlled;
  }
  judge_services(look, found(BoxAlarm::service_failed), why(BoxAlarm::service_failed));
  judge_certificates(look, found(BoxAlarm::certificate_expires),
                     why(BoxAlarm::certificate_expires));

  if (dropped_ && look.dropped > *dropped_) dropped_at_ms_ = look.monotonic_ms;
  dropped_ = look.dropped;
  found(BoxAlarm::records_dropped) = within(dropped_at_ms_);
  if (within(dropped_at_ms_)) {
    why(BoxAlarm::records_dropped) = fmt::format("{} cycles since the start", look.dropped);
  }

  if (look.writes.full_hour && look.writes.per_day_b) {
    found(BoxAlarm::disk_writes) = *look.writes.per_day_b > look.write_budget_b;
    if (*found(BoxAlarm::disk_writes)) {
      why(BoxAlarm::disk_writes) =
          fmt::format("{:.0f} MB a day in the last hour, the budget is {:.0f} MB",
                      *look.writes.per_day_b / 1e6, look.write_budget_b / 1e6);
    }
  }
  return report;
}

}  // namespace loopwarden::daemon::host
