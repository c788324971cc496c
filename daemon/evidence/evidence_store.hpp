// SPDX-License-Identifier: Apache-2.0
// Writes evidence below one folder, with a thread of its own for the disk, and keeps the newest of it. An incident has one
// folder, that of the alarm that opened it; what joins lies within, the newest kMostJoined of it.
//
// Whoever posts never waits. While the disk refuses, evidence waits in memory, a little of it, and is
// tried again; the oldest goes when there is no room, counted. Writing it again is no duty of anyone: an
// alarm does not depend on its evidence.
#pragma once

#include <atomic>
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
  std::filesystem::path folder;           // made where it is missing
  std::size_t most_kept = 200;            // folders, about 200 kB each; 0: nothing is written
  std::size_t most_waiting = 16;          // in memory
  std::chrono::milliseconds retry{5000};  // between attempts at a disk that refuses
};

struct EvidenceStatus {
  std::uint64_t written = 0;  // since the start
  std::uint64_t waiting = 0;
  std::uint64_t lost = 0;     // found no room in memory either
  std::string error;          // why evidence is waiting; empty: it is not
  std::string removal_error;  // why more than most_kept are there; empty: they are not
};

class EvidenceStore {
 public:
  // `specialists` by the folder's name that evidence has. `report` is called by the store's thread once
  // evidence has its folder, and once when the disk begins to refuse: then `why` says so.
  using Report = std::function<void(const evidence::Evidence& evidence,
                                    const std::filesystem::path& folder, const std::string& why)>;
  // By the store's thread, once when old evidence can't be removed. New evidence is written all the same.
  using ReportRemoval = std::function<void(const std::string& why)>;
  EvidenceStore(EvidenceSettings settings,
                std::map<std::string, config::SpecialistFolder> specialists, Report report,
                ReportRemoval report_removal = {});
  EvidenceStore(const EvidenceStore&) = delete;
  EvidenceStore& operator=(const EvidenceStore&) = delete;
  ~EvidenceStore() { stop(); }

  void start();
  // Writes what is waiting, if the disk takes it, and ends the thread.
  void stop();
  // As stop(), for at most `patience`; false if the disk hangs.
  bool stop_for(std::chrono::milliseconds patience);

  // Any thread but the real-time one.
  void post(evidence::Evidence evidence);
  EvidenceStatus status() const;
  static constexpr std::size_t kMostJoined = 8;
  // The newest folder of this alarm on the disk, that of an incident's first alarm or within it; waits for it.
  std::optional<std::filesystem::path> newest(const std::string& loop,
                                              alarm::AlarmKind alarm) const;

 private:
  void ask_to_end();
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
  std::list<evidence::Evidence> queue_;  // its items stay where they are
  EvidenceStatus status_;
  bool quit_ = false;
  base::DiskWait wait_;
  base::Thread thread_;
};

}  // namespace loopwarden::daemon
