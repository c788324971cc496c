// SPDX-License-Identifier: Apache-2.0
// Takes every cycle of every loop from the real-time thread: keeps the last minutes in memory for
// `loopwarden top`, writes the ring of segments, and a CSV record where one was asked for.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "daemon/loop_runtime.hpp"
#include "hal/os/thread.hpp"
#include "hal/record/record_csv.hpp"
#include "hal/record/record_row.hpp"
#include "hal/record/segment_ring.hpp"

namespace loopwarden::daemon {

// What the historian knows of one loop's recording.
struct RecordingStatus {
  std::uint64_t rows = 0;     // taken from the real-time thread
  std::uint64_t dropped = 0;  // lost because the ring was full
  hal::record::SegmentStatus segments;
  std::string csv_file;   // empty: no CSV record is being written
  std::string csv_error;  // why the last CSV record is incomplete; empty: it is not
};

class Historian {
 public:
  // Rows kept in memory per loop.
  static constexpr std::size_t kKept = 512;

  Historian(std::vector<LoopRuntime>& loops, std::filesystem::path state_directory);
  Historian(const Historian&) = delete;
  Historian& operator=(const Historian&) = delete;
  ~Historian() { stop(); }

  // Starts the thread. Segments that can't be opened are reported in status(), not thrown.
  void start();
  void stop();

  // Any thread.
  bool latest(std::size_t loop, hal::record::RecordRow& row) const;
  // PV units; 0 before the first.
  double last_good_pv(std::size_t loop) const;
  // Rows with a period index of at least `from`, oldest first, at most `most`.
  std::vector<hal::record::RecordRow> rows(std::size_t loop, std::uint64_t from,
                                           std::size_t most) const;
  RecordingStatus status(std::size_t loop) const;
  // Begins a CSV record in the state directory; returns its path. Throws std::runtime_error.
  std::string start_csv(std::size_t loop, const std::string& name);
  // Ends it; returns its path, empty if there was none. Throws std::runtime_error if it is incomplete.
  std::string stop_csv(std::size_t loop);

  std::uint64_t ticks() const noexcept { return ticks_.load(std::memory_order_relaxed); }

 private:
  struct Track {
    std::vector<hal::record::RecordRow> kept;  // ring of kKept rows
    std::uint64_t rows = 0;                    // ever put there
    double last_good_pv = 0.0;                 // PV units
    hal::record::SegmentStatus segment_status;
  };
  // Only the historian's thread touches it.
  struct Disk {
    std::unique_ptr<hal::record::SegmentWriter> segments;
  };
  struct Csv {
    std::unique_ptr<hal::record::RecordCsvWriter> writer;
    std::uint64_t first_period = 0;
    std::uint64_t next_period = 0;  // 0 rows so far: equal to first_period
    bool begun = false;
    std::string error;
  };

  void run();
  void take_rows(std::size_t loop);
  void keep(std::size_t loop);
  void write_csv(std::size_t loop);

  std::vector<LoopRuntime>& loops_;
  std::filesystem::path state_directory_;
  std::vector<hal::record::RecordRow> fresh_;  // of the loop being served; historian's thread only
  std::vector<Disk> disks_;

  mutable std::mutex tracks_mutex_;
  std::vector<Track> tracks_;
  mutable std::mutex csv_mutex_;  // apart, so that a slow disk does not delay the status
  std::vector<Csv> csv_;

  std::atomic<bool> quit_{false};
  std::atomic<std::uint64_t> ticks_{0};
  hal::os::Thread thread_;
};

}  // namespace loopwarden::daemon
