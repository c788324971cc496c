// SPDX-License-Identifier: Apache-2.0
#include "daemon/box/box_looker.hpp"

#include <spdlog/spdlog.h>

#include <exception>
#include <system_error>

#include "base/clock.hpp"
#include "daemon/box/box_judge.hpp"
#include "daemon/box/certificate_file.hpp"
#include "daemon/box/failed_services.hpp"

namespace loopwarden::daemon::box {
namespace {

constexpr std::chrono::seconds kPeriod{5};

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

BoxLook look_at(const BoxSources& sources) {
  const protocol::DaemonStatus status = sources.status();
  BoxLook look{.monotonic_ms = monotonic_ms(),
               .utc_ms = base::utc_ms(),
               .room_bytes = room(sources.state_directory),
               .journal_error = status.journal.error,
               .failed_services = failed_services(),
               .dropped = sources.dropped()};
  for (const protocol::FeederStatus& feeder : status.feeders) {
    if (!feeder.connected) look.lost_feeders.push_back(feeder.name);
  }
  for (const std::string& file : sources.certificates) {
    look.certificates.push_back({file, end_of_certificate(file)});
  }
  return look;
}

}  // namespace

void BoxLooker::start() {
  thread_.start({.name = "lw-box"}, [this] { run(); });
}

void BoxLooker::ask_to_end() {
  {
    const std::lock_guard lock(mutex_);
    quit_ = true;
  }
  wake_.notify_all();
}

void BoxLooker::stop() {
  ask_to_end();
  thread_.join();
}

bool BoxLooker::stop_for(std::chrono::milliseconds patience) {
  ask_to_end();
  return thread_.join_for(patience);
}

void BoxLooker::run() {
  BoxJudge judge;
  std::unique_lock lock(mutex_);
  while (!quit_) {
    lock.unlock();
    try {
      const BoxLook look = look_at(sources_);
      board_.look(judge.judge(look), look.monotonic_ms);
    } catch (const std::exception& e) {
      spdlog::error("box: {}", e.what());
    }
    lock.lock();
    wake_.wait_for(lock, kPeriod, [this] { return quit_; });
  }
}

}  // namespace loopwarden::daemon::box
