// SPDX-License-Identifier: Apache-2.0
#include "services/notify/watch/watcher.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <exception>
#include <iterator>
#include <utility>

#include "protocol/ask.hpp"
#include "services/notify/text/one_line.hpp"
#include "services/notify/watch/answers.hpp"

namespace loopwarden::notify {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPeriod{1000};
constexpr std::uint64_t kNewestLines = 200;  // of the journal
// An answer that takes so long is as good as none.
constexpr std::chrono::milliseconds kLate{3000};

}  // namespace

void keep_reasons(Snapshot& newer, Snapshot older) {
  constexpr std::size_t kMostLines = 1000;
  std::move(older.journal.begin(), older.journal.end(), std::back_inserter(newer.journal));
  if (newer.journal.size() > kMostLines) newer.journal.resize(kMostLines);
}

void Watcher::start() {
  thread_.start({.name = "lw-watch"}, [this] { run(); });
}

bool Watcher::stop_for(std::chrono::milliseconds patience) {
  {
    const std::lock_guard lock(mutex_);
    quit_ = true;
  }
  wake_.notify_all();
  return thread_.join_for(patience);
}

void Watcher::run() {
  std::unique_lock lock(mutex_);
  while (!quit_) {
    lock.unlock();
    std::string why;
    try {
      ask();
    } catch (const protocol::DaemonError& e) {
      why = (e.refused() ? "the daemon says: " : "") + one_line(e.what());
    } catch (const std::exception& e) {
      why = e.what();
    }
    lock.lock();
    if (why != error_) {
      why.empty() ? spdlog::info("the daemon answers") : spdlog::warn("{}", why);
      error_ = why;
    }
    wake_.wait_for(lock, kPeriod, [this] { return quit_; });
  }
}

void Watcher::ask() {
  Snapshot snapshot;
  snapshot.alarms = readings_of(protocol::ask(daemon_, protocol::AlarmsRequest{}));
  if (changed(snapshot.alarms)) {
    describe();
    try {
      snapshot.journal =
          lines_of(protocol::ask(daemon_, protocol::JournalRequest{.most = kNewestLines}));
    } catch (const std::exception& e) {
      // The alarm counts; who and why are missing then.
      spdlog::warn("no reasons: {}", e.what());
    }
  }
  for (AlarmReading& alarm : snapshot.alarms) {
    const auto known = descriptions_.find(alarm.key.first);
    if (known != descriptions_.end()) alarm.description = known->second;
  }
  before_ = snapshot.alarms;
  const std::lock_guard lock(mutex_);
  if (snapshot_) keep_reasons(snapshot, std::move(*snapshot_));
  snapshot_ = std::move(snapshot);
  answered_ = Clock::now();
}

// Only where something may be told. A reload may have changed them.
void Watcher::describe() {
  try {
    descriptions_ = descriptions_of(protocol::ask(daemon_, protocol::DescribeRequest{}));
  } catch (const protocol::DaemonError& e) {
    if (e.kind() == protocol::DaemonError::Kind::down) throw;
    spdlog::warn("no descriptions: {}", e.what());
  }
}

bool Watcher::changed(const std::vector<AlarmReading>& alarms) {
  return !std::equal(alarms.begin(), alarms.end(), before_.begin(), before_.end(),
                     [](const AlarmReading& a, const AlarmReading& b) {
                       return a.key == b.key && a.state == b.state &&
                              a.times_raised == b.times_raised;
                     });
}

std::optional<Snapshot> Watcher::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(snapshot_, std::nullopt);
}

std::chrono::milliseconds Watcher::silent() const {
  const std::lock_guard lock(mutex_);
  const auto since =
      std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - answered_);
  return error_.empty() && since < kPeriod + kLate ? std::chrono::milliseconds(0) : since;
}

std::string Watcher::error() const {
  const std::lock_guard lock(mutex_);
  return error_;
}

}  // namespace loopwarden::notify
