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

namespace loopwarden::daemon {
namespace {

namespace fs = std::filesystem;

// 20261121T233348123Z-FIC-101-stiction: the order of names is that of time.
constexpr std::size_t kStamp = 19;

std::string folder_name(const evidence::Evidence& e) {
  return fmt::format("{:%Y%m%dT%H%M%S}{:03}Z-{}-{}",
                     fmt::gmtime(static_cast<std::time_t>(e.raised_ms / 1000)), e.raised_ms % 1000,
                     e.loop, monitor::to_text(e.alarm));
}

// Those that have their name, the oldest first; empty while the folder can't be read.
std::vector<fs::path> folders_in(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (name.size() > kStamp && name[kStamp] == '-' && name.front() != '.')
      found.push_back(it->path());
  }
  std::sort(found.begin(), found.end());
  return found;
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

void EvidenceStore::ask_to_end() {
  {
    const std::lock_guard lock(mutex_);
    quit_ = true;
  }
  changed_.notify_all();
}

void EvidenceStore::stop() {
  ask_to_end();
  thread_.join();
}

bool EvidenceStore::stop_for(std::chrono::milliseconds patience) {
  ask_to_end();
  return thread_.join_for(patience);
}

void EvidenceStore::post(evidence::Evidence evidence) {
  if (settings_.most_kept == 0) return;
  {
    const std::lock_guard lock(mutex_);
    queue_.push_back(std::move(evidence));
    // The first one may be under the writer's pen.
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
                                              monitor::AlarmKind alarm) const {
  const std::string wanted = loop + "-" + monitor::to_text(alarm);
  const std::vector<fs::path> folders = folders_in(settings_.folder);
  const auto found = std::find_if(folders.rbegin(), folders.rend(), [&](const fs::path& folder) {
    return folder.filename().string().substr(kStamp + 1) == wanted;
  });
  if (found == folders.rend()) return std::nullopt;
  return *found;
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
  // Only this thread takes the first one away.
  const evidence::Evidence* first = nullptr;
  {
    const std::lock_guard lock(mutex_);
    first = &queue_.front();
  }
  const fs::path folder = settings_.folder / folder_name(*first);
  std::string why;
  std::string removal;
  try {
    const base::DiskWait::Section waiting(wait_);
    const auto specialists = specialists_.find(first->specialists_folder);
    if (first->by_specialists() && specialists == specialists_.end())
      throw evidence::EvidenceError("its specialists are not there");
    fs::create_directories(settings_.folder);
    if (!fs::exists(folder)) {
      evidence::write_evidence(*first, first->by_specialists() ? &specialists->second : nullptr,
                               folder);
    }
    removal = remove_old();
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

std::string EvidenceStore::remove_old() const {
  const std::vector<fs::path> folders = folders_in(settings_.folder);
  if (folders.size() <= settings_.most_kept) return {};
  const auto beyond = static_cast<std::ptrdiff_t>(folders.size() - settings_.most_kept);
  std::string why;
  for (auto it = folders.begin(); it != folders.begin() + beyond; ++it) {
    std::error_code error;
    fs::remove_all(*it, error);
    if (error && why.empty()) why = fmt::format("{}: {}", it->string(), error.message());
  }
  return why;
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
