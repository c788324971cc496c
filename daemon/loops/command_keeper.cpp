// SPDX-License-Identifier: Apache-2.0
#include "daemon/loops/command_keeper.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <utility>

#include "base/clock.hpp"

namespace loopwarden::daemon {
namespace {

constexpr std::chrono::milliseconds kBetweenLooks{50};
constexpr double kBetweenWrites_s = 10.0;  // for a set point that moves all the time
constexpr std::int64_t kRetry_ns = 5 * base::kNanosecondsPerSecond;

bool runs_here(const LoopRuntime& loop) {
  return !loop.watched() && config::out_of_service(loop.config.io) == nullptr;
}

}  // namespace

CommandKeeper::CommandKeeper(const std::vector<LoopRuntime>& loops, LastCommandsFile file,
                             LastCommands begun)
    : loops_(loops), file_(std::move(file)), tracks_(loops.size()) {
  for (std::size_t i = 0; i < loops.size(); ++i) {
    if (!runs_here(loops[i])) continue;
    const auto found = begun.loops.find(loops[i].config.name);
    if (found == begun.loops.end()) continue;
    tracks_[i].now = tracks_[i].saved = found->second;
    tracks_[i].ever_saved = true;
    begun.loops.erase(found);
  }
  // Commands of a loop out of service are kept. Its tag may be unknown because its file is
  // unreadable.
  const bool all_run = std::all_of(loops.begin(), loops.end(), [](const LoopRuntime& loop) {
    return loop.watched() || runs_here(loop);
  });
  if (!all_run) resting_ = std::move(begun.loops);
  forget_ = all_run && !begun.loops.empty();
}

void CommandKeeper::start() {
  thread_.start({.name = "lw-orders"}, [this] { run(); });
}

void CommandKeeper::run() {
  bool last = false;
  while (!last) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, kBetweenLooks, [&] { return quit_ || asked_for_; });
      asked_for_ = false;
      last = quit_;
    }
    try {
      look(base::MonotonicClock().now_ns());
    } catch (const std::exception& e) {
      spdlog::error("last orders: {}", e.what());
    }
  }
}

// Records the values in force in the loop. In manual a set point that follows PV is not a command.
// During a test, a restart continues with the values from before the test.
void CommandKeeper::see(std::size_t loop) {
  const LoopRuntime& runtime = loops_[loop];
  LastCommand& now = tracks_[loop].now;
  const std::optional<Commissioning::Holder> holder = runtime.commissioning->holder();
  now.commissioned = holder && holder->purpose == Commissioning::Purpose::work;
  if (holder) return;
  const rt::LoopChannels& channels = *runtime.channels;
  const rt::LoopAvailability availability =
      rt::unpacked(channels.availability.load(std::memory_order_acquire));
  now.mode = availability.mode;
  now.manual_after_fault = availability.manual_after_fault;
  now.pv_unit = runtime.config.pv_unit;
  now.pv_range = {runtime.config.pv.low, runtime.config.pv.high};
  if (now.mode == control::Mode::automatic ||
      !runtime.settings->get().controller.set_point_tracks_in_manual) {
    now.set_point = channels.set_point_wanted.load(std::memory_order_relaxed);
  }
}

bool CommandKeeper::is_due(Track& track, std::int64_t now_ns) const {
  const double passed_s = static_cast<double>(now_ns - std::exchange(track.looked_ns, now_ns)) /
                          static_cast<double>(base::kNanosecondsPerSecond);
  track.writes_left = std::min(kMostWrites, track.writes_left + passed_s / kBetweenWrites_s);
  if (track.ever_saved && track.now == track.saved) return false;
  LastCommand but_for_set_point = track.saved;
  but_for_set_point.set_point = track.now.set_point;
  if (!track.ever_saved || track.asked_for || frozen_ || but_for_set_point != track.now) {
    return true;
  }
  if (track.writes_left < 1.0) return false;
  track.writes_left -= 1.0;
  return true;
}

bool CommandKeeper::look(std::int64_t now_ns) {
  std::map<std::string, LastCommand> all = resting_;
  std::vector<LastCommand> written(tracks_.size());
  {
    const std::lock_guard lock(mutex_);
    bool due = forget_;
    for (std::size_t i = 0; i < tracks_.size(); ++i) {
      if (!runs_here(loops_[i])) continue;
      if (!frozen_) see(i);
      due = is_due(tracks_[i], now_ns) || due;
    }
    if (!due || now_ns < retry_ns_) return false;
    for (std::size_t i = 0; i < tracks_.size(); ++i) {
      if (!runs_here(loops_[i])) continue;
      written[i] = all[loops_[i].config.name] = tracks_[i].now;
      tracks_[i].asked_for = false;
    }
  }
  const std::string failed = file_.save(all);
  if (!failed.empty() && failed != reported_) {
    spdlog::error("last orders: not written: {}; after a restart older orders apply", failed);
  }
  reported_ = failed;
  const std::lock_guard lock(mutex_);
  retry_ns_ = failed.empty() ? 0 : now_ns + kRetry_ns;
  forget_ = forget_ && !failed.empty();
  for (std::size_t i = 0; failed.empty() && i < tracks_.size(); ++i) {
    tracks_[i].saved = written[i];
    tracks_[i].ever_saved = true;
  }
  return failed.empty();
}

bool CommandKeeper::kept(std::size_t loop) {
  {
    const std::lock_guard lock(mutex_);
    if (!runs_here(loops_[loop]) || frozen_) return true;
    see(loop);
    Track& track = tracks_[loop];
    if (track.ever_saved && track.now == track.saved) return true;
    track.asked_for = asked_for_ = true;
  }
  changed_.notify_all();
  return false;
}

void CommandKeeper::freeze() {
  const std::lock_guard lock(mutex_);
  if (frozen_) return;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (runs_here(loops_[i])) see(i);
  }
  frozen_ = true;
}

void CommandKeeper::stop() {
  base::ask_to_end(mutex_, quit_, changed_);
  thread_.join();
}

bool CommandKeeper::stop_for(std::chrono::milliseconds patience) {
  base::ask_to_end(mutex_, quit_, changed_);
  return thread_.join_for(patience);
}

}  // namespace loopwarden::daemon
