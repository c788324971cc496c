// SPDX-License-Identifier: Apache-2.0
#include "services/notify/subscription/watcher.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <exception>
#include <iterator>
#include <utility>

#include "daemon/protocol/ask.hpp"
#include "services/notify/text/one_line.hpp"
#include "services/notify/subscription/answers.hpp"

namespace loopwarden::notify {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPeriod{1000};
constexpr std::uint64_t kNewestLines = 200;  // of the journal
// Time limit for all explanations of one change.
constexpr std::chrono::milliseconds kExplains{2000};
// An answer that takes longer counts as missing.
constexpr std::chrono::milliseconds kLateAfter{3000};

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
  base::ask_to_end(mutex_, quit_, wake_);
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

template <class Request>
auto Watcher::answer_to(const Request& request) {
  const auto heard = [this] {
    const std::lock_guard lock(mutex_);
    answered_ = Clock::now();
  };
  try {
    auto answer = protocol::ask(daemon_, request);
    heard();
    return answer;
  } catch (const protocol::DaemonError& e) {
    if (e.kind() != protocol::DaemonError::Kind::down) heard();
    throw;
  }
}

void Watcher::ask() {
  Snapshot snapshot;
  snapshot.alarms = readings_of(answer_to(protocol::AlarmsRequest{}));
  if (changed(snapshot.alarms)) {
    describe();
    explain(snapshot.alarms);
    try {
      snapshot.journal = lines_of(answer_to(protocol::JournalRequest{.most = kNewestLines}));
    } catch (const std::exception& e) {
      // The alarm is reported without persons and reasons.
      spdlog::warn("no reasons: {}", e.what());
    }
  }
  for (AlarmReading& alarm : snapshot.alarms) {
    if (const auto loop = loops_.find(alarm.key.first); loop != loops_.end()) {
      alarm.description = loop->second.description;
      alarm.area = loop->second.area;
    }
    if (const auto known = words_.find(alarm.key); known != words_.end()) {
      const AlarmWords& words = known->second.words;
      alarm.why = words.why;
      alarm.consequence = words.consequence;
      alarm.action = words.action;
      alarm.time_to_act = words.time_to_act;
    }
  }
  before_ = snapshot.alarms;
  const std::lock_guard lock(mutex_);
  if (snapshot_) keep_reasons(snapshot, std::move(*snapshot_));
  snapshot_ = std::move(snapshot);
}

// Called only if something may be reported. A reload may have changed the descriptions.
void Watcher::describe() {
  try {
    loops_ = words_of(answer_to(protocol::DescribeRequest{}));
  } catch (const protocol::DaemonError& e) {
    if (e.kind() == protocol::DaemonError::Kind::down) throw;
    spdlog::warn("no descriptions: {}", e.what());
  }
}

// Reads the newest explanations of the active alarms. The alarms don't wait for them: in a flood,
// or with a slow disk, they are reported without. Explanations of the same incident or raise are
// kept until new ones arrive.
void Watcher::explain(const std::vector<AlarmReading>& alarms) {
  constexpr std::size_t kMostExplained = 20;
  const Clock::time_point until = Clock::now() + kExplains;
  std::map<AlarmKey, Explained> words;
  std::size_t asked = 0;
  for (const AlarmReading& alarm : alarms) {
    if (!is_told(alarm.state)) continue;
    if (const auto known = words_.find(alarm.key);
        known != words_.end() && known->second.is_of(alarm)) {
      words.insert(*known);
    }
    if (asked >= kMostExplained || Clock::now() > until) continue;
    ++asked;
    try {
      const auto told =
          answer_to(protocol::ExplainRequest{.loop = alarm.key.first, .alarm = alarm.key.second});
      words[alarm.key] = {words_of(told, alarm), alarm.incident, alarm.times_raised};
    } catch (const protocol::DaemonError& e) {
      if (e.kind() == protocol::DaemonError::Kind::down) throw;
    }
  }
  words_ = std::move(words);
}

bool Watcher::changed(const std::vector<AlarmReading>& alarms) {
  return !std::equal(alarms.begin(), alarms.end(), before_.begin(), before_.end(),
                     [](const AlarmReading& a, const AlarmReading& b) {
                       return a.key == b.key && a.state == b.state &&
                              a.times_raised == b.times_raised &&
                              a.incident_says == b.incident_says;
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
  return error_.empty() && since < kPeriod + kLateAfter ? std::chrono::milliseconds(0) : since;
}

std::string Watcher::error() const {
  const std::lock_guard lock(mutex_);
  return error_;
}

}  // namespace loopwarden::notify
