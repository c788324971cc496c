// SPDX-License-Identifier: Apache-2.0
// Checks the box every few seconds on a separate thread. A second thread reads the disk, so that a
// hanging disk does not stop the other checks.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "base/thread.hpp"
#include "daemon/host/host_alarms.hpp"
#include "daemon/host/host_judge.hpp"
#include "daemon/host/write_meter.hpp"
#include "base/blocking/blocking_worker.hpp"
#include "daemon/protocol/answers.hpp"

namespace loopwarden::daemon::host {

// Reads the disk's data. May hang.
DiskLook look_at_disk(const std::filesystem::path& state_directory,
                      const std::vector<std::string>& certificates);

struct BoxSources {
  // must own all data that it uses, because it may outlive every other part
  std::function<DiskLook()> disk;
  std::function<protocol::DaemonStatus()> status;
  std::function<LostConnections(double uptime_s)> lost_connections;
  std::function<std::uint64_t()> dropped;  // cycles for which recorder or monitor was too slow
  // sockets of the daemon that can't be opened, with the reason
  std::function<std::vector<std::string>()> failed_parts;
  double write_budget_b = 0.0;             // B per day; NaN: no limit
  std::chrono::milliseconds period{5000};  // between two checks
};

class HostProbe {
 public:
  HostProbe(BoxSources sources, HostAlarms& board) : sources_(std::move(sources)), board_(board) {}
  HostProbe(const HostProbe&) = delete;
  HostProbe& operator=(const HostProbe&) = delete;
  ~HostProbe() { stop(); }

  void start();
  void stop();
  // Does the same as stop(), for at most `patience`. Returns false if the thread still hangs in a
  // call.
  bool stop_for(std::chrono::milliseconds patience);

  // Returns the writes up to the last check. From any thread.
  WriteRate writes() const;
  double write_budget_b() const noexcept { return sources_.write_budget_b; }  // B per day

 private:
  void run();
  BoxLook look();

  BoxSources sources_;
  HostAlarms& board_;
  WriteMeter meter_;
  mutable std::mutex writes_mutex_;
  WriteRate writes_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool quit_ = false;
  base::BlockingWorker disk_{"lw-box-disk"};
  base::Thread thread_;
};

}  // namespace loopwarden::daemon::host
