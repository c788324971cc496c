// SPDX-License-Identifier: Apache-2.0
// Looks at the box every few seconds, on a thread of its own: a disk or a bus that hangs delays nothing but this.
#pragma once

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "base/thread.hpp"
#include "daemon/box/box_board.hpp"
#include "protocol/answers.hpp"

namespace loopwarden::daemon::box {

struct BoxSources {
  std::filesystem::path state_directory;
  std::vector<std::string> certificates;
  std::function<protocol::DaemonStatus()> status;
  std::function<std::uint64_t()> dropped;  // cycles that the recorder was too slow for
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

  BoxSources sources_;
  BoxBoard& board_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool quit_ = false;
  base::Thread thread_;
};

}  // namespace loopwarden::daemon::box
