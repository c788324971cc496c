// SPDX-License-Identifier: Apache-2.0
#include "daemon/host/host_probe.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <exception>
#include <system_error>

#include "base/clock.hpp"
#include "daemon/host/certificate_file.hpp"
#include "daemon/host/failed_services.hpp"

namespace loopwarden::daemon::host {
namespace {

constexpr std::chrono::seconds kDiskPatience{1};

std::int64_t monotonic_ms() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

std::optional<std::uint64_t> room(const std::filesystem::path& folder) {
  std::error_code error;
  const std::filesystem::space_info space = std::filesystem::space(folder, error);
  if (error) return std::nullopt;
  return space.available;
}

}  // namespace

DiskLook look_at_disk(const std::filesystem::path& state_directory,
                      const std::vector<std::string>& certificates) {
  DiskLook look{.room_bytes = room(state_directory)};
  for (const std::string& file : certificates) {
    look.certificates.push_back({file, end_of_certificate(file)});
  }
  return look;
}

WriteRate HostProbe::writes() const {
  const std::lock_guard lock(writes_mutex_);
  return writes_;
}

BoxLook HostProbe::look() {
  if (const std::optional<std::uint64_t> bytes = bytes_written()) {
    const WriteRate rate = meter_.add(monotonic_ms(), *bytes);
    const std::lock_guard lock(writes_mutex_);
    writes_ = rate;
  }
  std::optional<DiskLook> disk = disk_.ask(sources_.disk, kDiskPatience);
  const protocol::DaemonStatus status = sources_.status();
  BoxLook look{.monotonic_ms = monotonic_ms(),
               .utc_ms = base::utc_ms(),
               .disk = std::move(disk),
               .disk_wait_s = std::max(disk_.seconds(), status.recorder.disk_wait_s),
               .journal_error = status.journal.error,
               .failed_services = failed_services(),
               .has_services = services_are_configured(),
               .failed_parts = sources_.failed_parts(),
               .dropped = sources_.dropped(),
               .writes = writes(),
               .write_budget_b = sources_.write_budget_b};
  LostConnections lost = sources_.lost_connections(status.uptime_s);
  look.lost_feeders = std::move(lost.feeders);
  look.lost_connections = std::move(lost.connections);
  // A feeder of no loop.
  for (const protocol::FeederStatus& feeder : status.feeders) {
    const bool named =
        std::any_of(look.lost_feeders.begin(), look.lost_feeders.end(),
                    [&](const LostConnection& one) { return one.what == feeder.name; });
    if (!feeder.connected && !named) look.lost_feeders.push_back({.what = feeder.name});
  }
  return look;
}

void HostProbe::start() {
  thread_.start({.name = "lw-box"}, [this] { run(); });
}

void HostProbe::stop() {
  base::ask_to_end(mutex_, quit_, wake_);
  thread_.join();
  disk_.stop();
}

bool HostProbe::stop_for(std::chrono::milliseconds patience) {
  const auto until = std::chrono::steady_clock::now() + patience;
  base::ask_to_end(mutex_, quit_, wake_);
  const bool ended = thread_.join_for(patience);
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
      until - std::chrono::steady_clock::now());
  return disk_.stop_for(std::max(left, std::chrono::milliseconds(0))) && ended;
}

void HostProbe::run() {
  HostJudge judge;
  std::unique_lock lock(mutex_);
  while (!quit_) {
    lock.unlock();
    try {
      const BoxLook now = look();
      board_.look(judge.judge(now), now.monotonic_ms);
    } catch (const std::exception& e) {
      spdlog::error("box: {}", e.what());
    }
    lock.lock();
    wake_.wait_for(lock, sources_.period, [this] { return quit_; });
  }
}

}  // namespace loopwarden::daemon::host
