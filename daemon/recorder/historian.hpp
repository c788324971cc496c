// SPDX-License-Identifier: Apache-2.0
// Takes every cycle of every loop from the real-time thread. It keeps the last minutes in memory
// for `loopwarden top` and passes all cycles to the recorder, which writes to the disk.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <vector>

#include "daemon/loops/loop_runtime.hpp"
#include "daemon/recorder/recorder.hpp"
#include "base/thread.hpp"
#include "record/record_row.hpp"

namespace loopwarden::daemon {

// Status of one loop's recording.
struct RecordingStatus : RecorderStatus {
  std::uint64_t rows = 0;     // taken from the real-time thread
  std::uint64_t dropped = 0;  // lost because the ring was full
};

// The values of a cycle that a trend shows.
struct TrendRow {
  std::uint64_t period_index = 0;
  double sp = 0.0;           // PV units
  double pv = 0.0;           // PV units
  double co = 0.0;           // CO units
  double stem = 0.0;         // CO units
  float jacket_rate = 0.0F;  // CO units/s
  float compensator = 0.0F;  // CO units
  control::Mode mode = control::Mode::manual;
};

class Historian {
 public:
  // Rows kept in memory per loop.
  static constexpr std::size_t kKept = 512;

  Historian(std::vector<LoopRuntime>& loops, RecorderSettings settings);
  Historian(const Historian&) = delete;
  Historian& operator=(const Historian&) = delete;
  ~Historian() { stop(); }

  // Starts the threads. Segments that can't be opened are reported in status(), not thrown.
  void start();
  void stop();
  // Does the same as stop(), but waits for the recorder's disk for at most `patience`. Returns
  // false if it hangs.
  bool stop_for(std::chrono::milliseconds patience);

  // From any thread. These functions never wait for the disk.
  bool latest(std::size_t loop, record::RecordRow& row) const;
  // PV units; 0 before the first good PV.
  double last_good_pv(std::size_t loop) const;
  // Returns at most `most` rows with a period index of at least `from`, oldest first.
  std::vector<TrendRow> trend(std::size_t loop, std::uint64_t from, std::size_t most) const;
  RecordingStatus status(std::size_t loop) const;
  // Returns the cycles of all loops that are missing in records or windows, because recorder or
  // monitor was too slow.
  std::uint64_t dropped() const;

  // CSV records and the state of the disk.
  Recorder& recorder() noexcept { return recorder_; }
  const Recorder& recorder() const noexcept { return recorder_; }

  std::uint64_t ticks() const noexcept { return ticks_.load(std::memory_order_relaxed); }

 private:
  struct Track {
    record::RecordRow latest;
    std::vector<TrendRow> kept;  // ring of kKept rows
    std::uint64_t rows = 0;      // number of rows since the start
    double last_good_pv = 0.0;   // PV units
  };

  void run();
  void take_rows(std::size_t loop);
  void keep(std::size_t loop);
  void end_thread() noexcept;

  std::vector<LoopRuntime>& loops_;
  Recorder recorder_;
  // of the loop being served; for the historian's thread only
  std::vector<record::RecordRow> fresh_;

  mutable std::mutex tracks_mutex_;
  std::vector<Track> tracks_;

  std::atomic<bool> quit_{false};
  std::atomic<std::uint64_t> ticks_{0};
  base::Thread thread_;
};

}  // namespace loopwarden::daemon
