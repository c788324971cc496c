// SPDX-License-Identifier: Apache-2.0
// Stores the loops' last commands on the disk, on a separate thread.
//
// It checks the loops every 50 ms. A change of the mode, or of a condition that forbids to
// continue, is written at once. The first eight changes of a set point in a row are written at once
// too. A set point that a master moves all the time is then written at most once in 10 s per loop.
// A request by `kept` is written at once.
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
  // `begun`: contents of the file at the start. The loops must outlive this.
  CommandKeeper(const std::vector<LoopRuntime>& loops, LastCommandsFile file, LastCommands begun);
  CommandKeeper(const CommandKeeper&) = delete;
  CommandKeeper& operator=(const CommandKeeper&) = delete;
  ~CommandKeeper() { stop(); }

  void start();
  // Call it when the daemon ends: later changes of the loops are not commands. Does not wait.
  void freeze();
  void stop();
  // Does the same as stop(), but waits for the disk for at most `patience`. Returns false if it
  // hangs.
  bool stop_for(std::chrono::milliseconds patience);

  // Returns whether the loop's values in force are on the disk. If not, they are written next. From
  // any thread.
  bool kept(std::size_t loop);

  // Checks the loops once. Public for tests. Returns true if the file was written.
  bool look(std::int64_t now_ns);

 private:
  static constexpr double kMostWrites = 8.0;  // set points in a row
  struct Track {
    LastCommand now;
    LastCommand saved;
    bool ever_saved = false;
    bool asked_for = false;
    double writes_left = kMostWrites;
    std::int64_t looked_ns = 0;
  };
  void run();
  void see(std::size_t loop);
  bool is_due(Track& track, std::int64_t now_ns) const;

  const std::vector<LoopRuntime>& loops_;
  LastCommandsFile file_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Track> tracks_;
  std::map<std::string, LastCommand> resting_;  // commands of loops out of service
  bool forget_ = false;                         // the disk has loops that no longer exist
  bool frozen_ = false;
  bool quit_ = false;
  bool asked_for_ = false;
  std::int64_t retry_ns_ = 0;
  std::string reported_;
  base::Thread thread_;
};

}  // namespace loopwarden::daemon
