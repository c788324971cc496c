// SPDX-License-Identifier: Apache-2.0
#include "daemon/journal/journal.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <iterator>
#include <new>
#include <system_error>
#include <thread>
#include <utility>

#include "base/clock.hpp"

namespace loopwarden::daemon::journal {
namespace {

constexpr std::chrono::milliseconds kPause{200};

}  // namespace

Journal::Journal(JournalSettings settings)
    : settings_(std::move(settings)), copy_(settings_.folder / "alarm-state.json") {}

AlarmStates Journal::open() {
  std::error_code ignored;  // open_file reports the error
  std::filesystem::create_directories(settings_.folder, ignored);
  std::string why;
  if (std::optional<AlarmStates> copy = copy_.load(why)) states_ = std::move(*copy);
  if (!why.empty()) spdlog::error("journal: {}", why);
  try {
    open_file();
    AlarmStates stored = file_->read_states();
    if (stored.revision >= states_.revision) states_ = std::move(stored);
  } catch (const sqlite::Error& e) {
    file_.reset();
    if (e.damaged()) {
      replace_damaged(e.what());
    } else {
      failed(e.what());
    }
  }
  // All states are written with the first write to a new file, or to one that is older than the
  // copy.
  changed_states_ = states_;
  return states_;
}

void Journal::open_file() {
  if (!file_) file_ = std::make_unique<JournalFile>(path(), settings_.most_rows);
}

void Journal::start() {
  thread_.start({.name = "lw-journal"}, [this] { run(); });
}

void Journal::stop() {
  base::ask_to_end(mutex_, quit_, changed_);
  thread_.join();
}

bool Journal::stop_for(std::chrono::milliseconds patience) {
  base::ask_to_end(mutex_, quit_, changed_);
  return thread_.join_for(patience);
}

std::uint64_t Journal::post(JournalEntry entry) {
  std::uint64_t ticket = 0;
  {
    const std::lock_guard lock(mutex_);
    if (refusals_.repeats(entry)) return posted_;
    ticket = ++posted_;
    queue_.push_back(std::move(entry));
    make_room();
    status_.waiting = in_hand_ + queue_.size();
  }
  changed_.notify_all();
  return ticket;
}

// Makes room in the queue. While the disk hangs, the journal's thread does not empty it.
void Journal::make_room() {
  while (queue_.size() > settings_.most_waiting) {
    const JournalEntry& oldest = queue_.front();
    // The stored state of an alarm is kept even if its line is lost.
    crowded_out_.take(oldest);
    queue_.pop_front();
    ++status_.lost;
  }
}

Written Journal::written_locked(std::uint64_t ticket) const {
  if (!status_.error.empty() || wait_.hung()) return Written::no;
  if (settled_ >= ticket) return Written::yes;
  return quit_ ? Written::no : Written::not_yet;
}

Written Journal::written(std::uint64_t ticket) const {
  const std::lock_guard lock(mutex_);
  return written_locked(ticket);
}

bool Journal::wait_written(std::uint64_t ticket, std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, patience, [&] { return written_locked(ticket) != Written::not_yet; });
  return written_locked(ticket) == Written::yes;
}

JournalStatus Journal::status() const {
  const std::lock_guard lock(mutex_);
  JournalStatus status = status_;
  if (status.error.empty() && wait_.hung()) {
    status.error = fmt::format("the disk has not answered for {:.0f} s", wait_.seconds());
  }
  return status;
}

std::vector<JournalRow> Journal::newest(std::size_t most, const std::string& loop) const {
  return search({.most = most, .loop = loop});
}

std::vector<JournalRow> Journal::search(const JournalQuery& query) const {
  // Uses a separate connection: in WAL mode, reader and writer don't disturb each other.
  try {
    return JournalFile::search(path(), query);
  } catch (const sqlite::Error&) {
    return {};
  }
}

std::vector<alarm::AlarmCame> Journal::came(std::int64_t from_ms, std::int64_t to_ms,
                                            std::size_t most) const {
  try {
    return JournalFile::came(path(), from_ms, to_ms, most);
  } catch (const sqlite::Error&) {
    return {};
  }
}

void Journal::run() {
  bool last_round = false;
  while (!last_round) {
    try {
      last_round = take_waiting();
      if (!waiting_.empty() && (last_round || std::chrono::steady_clock::now() >= retry_at_)) {
        const base::DiskWait::Section waiting(wait_);
        // Writes again if the file had to be replaced.
        if (!write_waiting()) write_waiting();
      }
    } catch (const std::bad_alloc&) {
      retry_at_ = std::chrono::steady_clock::now() + settings_.retry;
      std::this_thread::sleep_for(kPause);
      const std::lock_guard lock(mutex_);
      last_round = quit_;
    }
  }
  file_.reset();
}

// Returns true if the journal is ending.
bool Journal::take_waiting() {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, kPause, [&] { return !queue_.empty() || quit_; });
  waiting_.reserve(waiting_.size() + queue_.size());  // takes all lines or none
  std::move(queue_.begin(), queue_.end(), std::back_inserter(waiting_));
  queue_.clear();
  taken_ = posted_;
  AlarmStates fresh = std::exchange(crowded_out_, {});
  for (JournalEntry& entry : waiting_) {
    fresh.take(entry);
    entry.memory.reset();
    entry.incident.reset();
  }
  if (!fresh.empty()) {
    states_.take(fresh);
    changed_states_.take(fresh);
    changed_states_.revision = states_.revision;
  }
  if (waiting_.size() > settings_.most_waiting) {
    const std::size_t excess = waiting_.size() - settings_.most_waiting;
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(excess));
    status_.lost += excess;
  }
  in_hand_ = waiting_.size();
  status_.waiting = in_hand_;
  return quit_;
}

// Returns false if the file was damaged and a new one must be tried.
bool Journal::write_waiting() {
  const bool states_changed = !changed_states_.empty();
  if (states_changed) save_copy();
  try {
    open_file();
    file_->write(waiting_, changed_states_);
  } catch (const sqlite::Error& e) {
    if (e.damaged()) {
      file_.reset();
      return !replace_damaged(e.what());
    }
    failed(e.what());
    return true;
  }
  changed_states_ = {.revision = states_.revision, .memories = {}, .incidents = {}};
  if (!reported_.empty()) {
    spdlog::warn("journal: works again; {} lines written late", waiting_.size());
    reported_.clear();
  }
  {
    const std::lock_guard lock(mutex_);
    status_.written += waiting_.size();
    settled_ = taken_;
    in_hand_ = 0;
    status_.waiting = queue_.size();
    status_.error.clear();
  }
  waiting_.clear();
  changed_.notify_all();
  return true;
}

void Journal::save_copy() {
  std::string why;
  if (!copy_.save(states_, why) && reported_.empty()) spdlog::error("journal: {}", why);
}

// Returns false if the file can't be moved.
bool Journal::replace_damaged(const std::string& why) {
  try {
    const std::int64_t now_ms = base::utc_ms();
    const std::filesystem::path aside = sqlite::move_aside(path(), now_ms);
    spdlog::error("journal: damaged ({}); kept as {}; a new file is started", why, aside.string());
    waiting_.push_back({.kind = JournalEntry::Kind::system,
                        .utc_ms = now_ms,
                        .loop = {},
                        .alarm = {},
                        .from = {},
                        .to = {},
                        .severity_percent = std::nullopt,
                        .peer = {},
                        .what = "journal replaced",
                        .old_value = aside.filename().string(),
                        .new_value = {},
                        .result = why,
                        .reason = {},
                        .memory = std::nullopt,
                        .incident = std::nullopt});
    const std::lock_guard lock(mutex_);
    ++status_.damaged;
  } catch (const std::exception& e) {
    failed(e.what());
    return false;
  }
  changed_states_ = states_;
  return true;
}

void Journal::failed(const std::string& why) {
  retry_at_ = std::chrono::steady_clock::now() + settings_.retry;
  if (reported_ != why) {
    spdlog::error("journal: not written: {}; its lines wait in memory", why);
    reported_ = why;
  }
  {
    const std::lock_guard lock(mutex_);
    status_.error = why;
  }
  changed_.notify_all();
}

}  // namespace loopwarden::daemon::journal
