// SPDX-License-Identifier: Apache-2.0
// Derives the box's alarms from checks of the box.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/host/host_alarms.hpp"
#include "daemon/host/write_meter.hpp"

namespace loopwarden::daemon::host {

inline constexpr std::uint64_t kLeastRoom_bytes = 100'000'000;
inline constexpr std::int64_t kClockStep_ms = 1000;
inline constexpr std::int64_t kRemembered_ms = 600'000;  // for clock steps and dropped cycles
inline constexpr double kCertificate_days = 14.0;
// A service that fails again and again runs for a short time in between.
inline constexpr std::int64_t kFailedAgain_ms = 20'000;
inline constexpr double kDiskHangs_s = 10.0;  // slow disks answer sooner

struct Certificate {
  std::string file;
  std::optional<std::int64_t> ends_s;  // s since 1970; nullopt: unreadable
};

// Data that only the disk can give.
struct DiskLook {
  std::optional<std::uint64_t> room_bytes{};  // nullopt: unknown
  std::vector<Certificate> certificates{};
};

// A lost feeder, link, device or source, with the loops behind it.
struct LostConnection {
  std::string what;
  std::vector<std::string> loops{};
  bool controlled = false;  // one of them is controlled here
};

struct LostConnections {
  std::vector<LostConnection> feeders{};
  std::vector<LostConnection> connections{};
};

struct BoxLook {
  std::int64_t monotonic_ms = 0;
  std::int64_t utc_ms = 0;
  std::optional<DiskLook> disk{};  // nullopt: the disk does not answer
  double disk_wait_s = 0.0;        // how long a call has been waiting for the disk
  std::string journal_error{};
  std::vector<LostConnection> lost_feeders{};
  std::vector<LostConnection> lost_connections{};
  std::optional<std::vector<std::string>> failed_services{};  // nullopt: systemd can't be asked
  bool has_services = false;                // systemd runs, and a service is configured
  std::vector<std::string> failed_parts{};  // of the daemon, each with its reason
  std::uint64_t dropped = 0;                // cycles since the start
  WriteRate writes{};
  double write_budget_b = 0.0;  // B per day; NaN: no limit
};

// Judges a check against the previous one. It uses no clock.
class HostJudge {
 public:
  BoxReport judge(const BoxLook& look);

 private:
  void judge_services(const BoxLook& look, std::optional<bool>& found, std::string& why);

  std::optional<std::int64_t> offset_ms_;  // UTC - monotonic
  std::int64_t failed_at_ms_ = 0;
  std::vector<std::string> failed_;  // services that failed at failed_at_ms_
  std::optional<std::int64_t> stepped_at_ms_;
  std::int64_t step_ms_ = 0;
  std::optional<std::uint64_t> dropped_;
  std::optional<std::int64_t> dropped_at_ms_;
};

}  // namespace loopwarden::daemon::host
