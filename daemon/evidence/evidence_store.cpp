// SPDX-License-Identifier: Apache-2.0
#include "daemon/evidence/evidence_store.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <ctime>
#include <iterator>
#include <system_error>
#include <utility>
#include <vector>

#include "base/clock.hpp"

namespace loopwarden::daemon {
namespace {

namespace fs = std::filesystem;

// 20261121T233348123Z-FIC-101-stiction: names sort by time.
constexpr std::size_t kStamp = 19;

std::string stamp_of(std::int64_t utc_ms) {
  return fmt::format("{:%Y%m%dT%H%M%S}{:03}Z", fmt::gmtime(static_cast<std::time_t>(utc_ms / 1000)),
                     utc_ms % 1000);
}

std::string folder_name(const evidence::Evidence& e) {
  return fmt::format("{}-{}-{}", stamp_of(e.raised_ms), e.loop, alarm::to_text(e.alarm));
}

std::string name_of(const fs::path& folder) { return folder.filename().string(); }

// Returns the loop in a name. Names of alarms contain no '-'.
std::string loop_in(const std::string& name) {
  return name.substr(kStamp + 1, name.rfind('-') - kStamp - 1);
}

// Sorts by the stamps in the names, oldest first. A stamp in the future is from before the clock
// was set back. It counts as the oldest.
void put_in_order(std::vector<fs::path>& folders) {
  const std::string now = stamp_of(base::utc_ms());
  const auto key = [&](const fs::path& folder) {
    const std::string name = name_of(folder);
    return std::pair(name.substr(0, kStamp) <= now, name);
  };
  std::sort(folders.begin(), folders.end(),
            [&](const fs::path& a, const fs::path& b) { return key(a) < key(b); });
}

// Returns the evidence folders by name, oldest first; empty if the folder can't be read.
std::vector<fs::path> folders_in(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const std::string name = name_of(it->path());
    if (name.size() > kStamp && name[kStamp] == '-' && name.front() != '.')
      found.push_back(it->path());
  }
  put_in_order(found);
  return found;
}

// Removes all but the newest `most` folders. Returns why some remain; empty: all were removed.
std::string remove_beyond(std::size_t most, const fs::path& folder) {
  const std::vector<fs::path> folders = folders_in(folder);
  std::string why;
  for (std::size_t i = 0; i + most < folders.size(); ++i) {
    std::error_code error;
    fs::remove_all(folders[i], error);
    if (error && why.empty()) why = fmt::format("{}: {}", folders[i].string(), error.message());
  }
  return why;
}

}  // namespace

EvidenceStore::EvidenceStore(EvidenceSettings settings,
                             std::map<std::string, config::SpecialistFolder> specialists,
                             Report report, ReportRemoval report_removal)
    : settings_(std::move(settings)),
      specialists_(std::move(specialists)),
      report_(std::move(report)),
      report_removal_(std::move(report_removal)) {}

void EvidenceStore::start() {
  thread_.start({.name = "lw-evidence"}, [this] { run(); });
}

void EvidenceStore::stop() {
  base::ask_to_end(mutex_, quit_, changed_);
  thread_.join();
}

bool EvidenceStore::stop_for(std::chrono::milliseconds patience) {
  base::ask_to_end(mutex_, quit_, changed_);
  return thread_.join_for(patience);
}

void EvidenceStore::post(evidence::Evidence evidence) {
  if (settings_.most_kept == 0) return;
  {
    const std::lock_guard lock(mutex_);
    queue_.push_back(std::move(evidence));
    // The writer may be working on the first one.
    if (queue_.size() > settings_.most_waiting) {
      queue_.erase(std::next(queue_.begin()));
      ++status_.lost;
    }
    status_.waiting = queue_.size();
  }
  changed_.notify_all();
}

EvidenceStatus EvidenceStore::status() const {
  const std::lock_guard lock(mutex_);
  EvidenceStatus status = status_;
  if (status.error.empty() && wait_.hung()) {
    status.error = fmt::format("the disk has not answered for {:.0f} s", wait_.seconds());
  }
  return status;
}

std::optional<fs::path> EvidenceStore::newest(const std::string& loop,
                                              alarm::AlarmKind alarm) const {
  const std::string wanted = loop + "-" + alarm::to_text(alarm);
  std::vector<fs::path> of_loop;
  for (const fs::path& folder : folders_in(settings_.folder)) {
    if (loop_in(name_of(folder)) != loop) continue;
    of_loop.push_back(folder);
    for (const fs::path& joined : folders_in(folder)) of_loop.push_back(joined);
  }
  put_in_order(of_loop);
  const auto newest = std::find_if(of_loop.rbegin(), of_loop.rend(), [&](const fs::path& folder) {
    return name_of(folder).substr(kStamp + 1) == wanted;
  });
  return newest == of_loop.rend() ? std::nullopt : std::optional(*newest);
}

// The first alarm of an incident was raised when the incident opened, later ones after it, unless
// the clock was set back.
fs::path EvidenceStore::place_of(const evidence::Evidence& e) const {
  const std::string name = folder_name(e);
  if (e.incident_ms == 0) return settings_.folder / name;
  const std::string opened = stamp_of(e.incident_ms);
  const std::vector<fs::path> folders = folders_in(settings_.folder);
  const auto first = std::find_if(folders.begin(), folders.end(), [&](const fs::path& folder) {
    const std::string of = name_of(folder);
    const bool in_incident = of.starts_with(opened) || (of >= opened && of <= name);
    return in_incident && loop_in(of) == e.loop;
  });
  const bool joins = first != folders.end() && name_of(*first) != name;
  return (joins ? *first : settings_.folder) / name;
}

void EvidenceStore::run() {
  for (;;) {
    bool refused = false;
    {
      std::unique_lock lock(mutex_);
      refused = !status_.error.empty();
      if (refused) {
        changed_.wait_for(lock, settings_.retry, [&] { return quit_; });
      } else {
        changed_.wait(lock, [&] { return quit_ || !queue_.empty(); });
      }
      if (queue_.empty() || (quit_ && refused)) {
        if (quit_) return;
        continue;
      }
    }
    write_first();
  }
}

void EvidenceStore::write_first() {
  // Only this thread removes the first one.
  const evidence::Evidence* first = nullptr;
  {
    const std::lock_guard lock(mutex_);
    first = &queue_.front();
  }
  fs::path folder;
  std::string why;
  std::string removal;
  try {
    const base::DiskWait::Section waiting(wait_);
    const auto specialists = specialists_.find(first->specialists_folder);
    if (first->by_specialists() && specialists == specialists_.end())
      throw evidence::EvidenceError("its specialists are missing");
    fs::create_directories(settings_.folder);
    folder = place_of(*first);
    if (!fs::exists(folder)) {
      evidence::write_evidence(*first, first->by_specialists() ? &specialists->second : nullptr,
                               folder);
    }
    if (folder.parent_path() != settings_.folder) remove_beyond(kMostJoined, folder.parent_path());
    removal = remove_beyond(settings_.most_kept, settings_.folder);
  } catch (const std::exception& e) {
    why = e.what();
  }
  bool news = false;
  {
    const std::lock_guard lock(mutex_);
    news = why.empty() || status_.error.empty();
    status_.error = why;
  }
  if (!why.empty() && news) spdlog::error("evidence: not written: {}; it waits in memory", why);
  if (news) report_(*first, folder, why);
  if (!why.empty()) return;
  tell_removal(removal);
  const std::lock_guard lock(mutex_);
  queue_.pop_front();
  ++status_.written;
  status_.waiting = queue_.size();
}

void EvidenceStore::tell_removal(const std::string& why) {
  bool news = false;
  {
    const std::lock_guard lock(mutex_);
    news = !why.empty() && status_.removal_error.empty();
    status_.removal_error = why;
  }
  if (!news) return;
  spdlog::error("evidence: old evidence is not removed: {}", why);
  if (report_removal_) report_removal_(why);
}

}  // namespace loopwarden::daemon
