// SPDX-License-Identifier: Apache-2.0
// Looks at the box every few seconds, on a thread of its own. The disk is asked on a second one: while it hangs the other
// alarms go on.
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
#include "daemon/host/box_board.hpp"
#include "daemon/host/box_judge.hpp"
#include "base/errand/disk_errand.hpp"
#include "daemon/protocol/answers.hpp"

namespace loopwarden::daemon::host {

// May hang.
DiskLook look_at_disk(const std::filesystem::path& state_directory,
                      const std::vector<std::string>& certificates);

struct BoxSources {
  std::function<DiskLook()> disk;  // owns all that it works on: it may outlast everything
  std::function<protocol::DaemonStatus()> status;
  std::function<std::uint64_t()> dropped;  // cycles that recorder or monitor was too slow for
  std::chrono::milliseconds period{5000};  // from look to look
};

class BoxLooker {
 public:
  BoxLooker(BoxSources sources, BoxBoard& board) : sources_(std::move(sources)), board_(board) {}
  BoxLooker(const BoxLooker&) = delete;
  BoxLooker& operator=(const BoxLooker&) = delete;
  ~BoxLooker() { stop(); }

  void start();
  void stop();
  // As stop(), for at most `patience`. False if the thread still hangs in a call.
  bool stop_for(std::chrono::milliseconds patience);

 private:
  void ask_to_end();
  void run();
  BoxLook look();

  BoxSources sources_;
  BoxBoard& board_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool quit_ = false;
  base::DiskErrand disk_{"lw-box-disk"};
  base::Thread thread_;
};

}  // namespace loopwarden::daemon::host
