// SPDX-License-Identifier: Apache-2.0
// Keeps the loops' last orders on the disk, with a separate thread for it.
//
// It looks at the loops each 50 ms. A change of the mode, or of what forbids to continue, is
// written at once. So is a set point that changes now and then. A set point that a master moves all
// the time is written at most once in 10 s for each loop, after the first eight changes; what is
// asked for by `kept` is written at once.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "base/thread.hpp"
#include "daemon/loops/last_commands.hpp"
#include "daemon/loops/loop_runtime.hpp"

namespace loopwarden::daemon {

class CommandKeeper {
 public:
  // `begun`: what is on the disk. The loops outlive this.
  CommandKeeper(const std::vector<LoopRuntime>& loops, LastCommandsFile file, LastCommands begun);
  CommandKeeper(const CommandKeeper&) = delete;
  CommandKeeper& operator=(const CommandKeeper&) = delete;
  ~CommandKeeper() { stop(); }

  void start();
  // The daemon ends: what happens to the loops from now on is no order. Waits for nothing.
  void freeze();
  void stop();
  // As stop(), but waits for the disk for at most `patience`; false if it hangs.
  bool stop_for(std::chrono::milliseconds patience);

  // Any thread: whether what the loop goes by is on the disk. If not, it is written next.
  bool kept(std::size_t loop);

  // One look; public for tests. True if the file was written.
  bool look(std::int64_t now_ns);

 private:
  static constexpr double kMostWrites = 8.0;  // of set points in a row
  struct Track {
    LastCommand now;
    LastCommand saved;
    bool ever_saved = false;
    bool asked_for = false;
    double writes_left = kMostWrites;
    std::int64_t looked_ns = 0;
  };
  void run();
  void ask_to_end();
  void see(std::size_t loop);
  bool is_due(Track& track, std::int64_t now_ns) const;

  const std::vector<LoopRuntime>& loops_;
  LastCommandsFile file_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Track> tracks_;
  std::map<std::string, LastCommand> resting_;  // of loops out of service
  bool forget_ = false;                         // loops that are on the disk, and are gone
  bool frozen_ = false;
  bool quit_ = false;
  bool asked_for_ = false;
  std::int64_t retry_ns_ = 0;
  std::string reported_;
  base::Thread thread_;
};

}  // namespace loopwarden::daemon
