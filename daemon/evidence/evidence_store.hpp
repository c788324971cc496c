// SPDX-License-Identifier: Apache-2.0
// Writes evidence below one folder on a separate thread, and keeps the newest. An incident has one
// folder, named after the alarm that opened it. Evidence of its later alarms is inside that folder,
// the newest kMostJoined of them.
//
// post() never waits. If the disk fails, a little evidence waits in memory and is tried again.
// Without room the oldest is dropped and counted. A loss is acceptable, because an alarm does not
// depend on its evidence.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "config/evidence_file/evidence_file.hpp"
#include "base/disk_wait.hpp"
#include "base/thread.hpp"

namespace loopwarden::daemon {

struct EvidenceSettings {
  std::filesystem::path folder;           // created if missing
  std::size_t most_kept = 200;            // folders, about 200 kB each; 0: no evidence is written
  std::size_t most_waiting = 16;          // in memory
  std::chrono::milliseconds retry{5000};  // between attempts at a failing disk
};

struct EvidenceStatus {
  std::uint64_t written = 0;  // since the start
  std::uint64_t waiting = 0;
  std::uint64_t lost = 0;     // did not fit into memory either
  std::string error;          // why evidence is waiting; empty: it is not
  std::string removal_error;  // why more than most_kept folders remain; empty: they don't
};

class EvidenceStore {
 public:
  // `specialists`: keyed by the folder name in the evidence. The store's thread calls `report` when
  // evidence has its folder, and once when the disk starts to fail, with the reason in `why`.
  using Report = std::function<void(const evidence::Evidence& evidence,
                                    const std::filesystem::path& folder, const std::string& why)>;
  // Called by the store's thread, once, when old evidence can't be removed. New evidence is still
  // written.
  using ReportRemoval = std::function<void(const std::string& why)>;
  EvidenceStore(EvidenceSettings settings,
                std::map<std::string, config::SpecialistFolder> specialists, Report report,
                ReportRemoval report_removal = {});
  EvidenceStore(const EvidenceStore&) = delete;
  EvidenceStore& operator=(const EvidenceStore&) = delete;
  ~EvidenceStore() { stop(); }

  void start();
  // Writes waiting evidence if the disk accepts it, and ends the thread.
  void stop();
  // Does the same as stop(), for at most `patience`. Returns false if the disk hangs.
  bool stop_for(std::chrono::milliseconds patience);

  // From any thread except the real-time one.
  void post(evidence::Evidence evidence);
  EvidenceStatus status() const;
  static constexpr std::size_t kMostJoined = 8;
  // Returns the newest folder of this alarm on the disk. That is the folder of an incident that the
  // alarm opened, or a folder inside an incident. Waits for the disk.
  std::optional<std::filesystem::path> newest(const std::string& loop,
                                              alarm::AlarmKind alarm) const;

 private:
  void run();
  void write_first();
  std::filesystem::path place_of(const evidence::Evidence& evidence) const;
  void tell_removal(const std::string& why);

  EvidenceSettings settings_;
  std::map<std::string, config::SpecialistFolder> specialists_;
  Report report_;
  ReportRemoval report_removal_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::list<evidence::Evidence> queue_;  // a list, so that items do not move
  EvidenceStatus status_;
  bool quit_ = false;
  base::DiskWait wait_;
  base::Thread thread_;
};

}  // namespace loopwarden::daemon
