// SPDX-License-Identifier: Apache-2.0
// Writes the historian's rows to the disk on a separate thread: the ring of segments, and requested
// CSV records.
//
// No other thread waits for the disk. Rows enter a bounded queue in memory, which bridges a minute
// or two. Rows that do not fit are dropped and counted. The watchdog ignores this thread.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/loops/loop_runtime.hpp"
#include "base/disk_wait.hpp"
#include "base/thread.hpp"
#include "record/record_csv.hpp"
#include "record/record_row.hpp"
#include "record/segment_ring.hpp"

namespace loopwarden::daemon {

struct RecorderSettings {
  std::filesystem::path state_directory;
  // Longest loss of rows in a power failure or crash. Zero: rows are written at once. nullopt: 60 s
  // on flash memory, 5 s on other disks.
  std::optional<std::chrono::milliseconds> sync{};
  double queue_s = 120.0;                           // s per loop that the disk may lag
  std::size_t queue_bytes = 8UL * 1024UL * 1024UL;  // of all loops together
};

// Status of the recording of one loop.
struct RecorderStatus {
  std::size_t waiting = 0;          // rows in memory
  std::uint64_t queue_dropped = 0;  // rows that did not fit into the queue
  record::SegmentStatus segments;
  std::string csv_file;   // empty: no CSV record is being written
  std::string csv_error;  // why the last CSV record is incomplete; empty: it is complete
};

class Recorder {
 public:
  Recorder(std::vector<LoopRuntime>& loops, RecorderSettings settings);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  ~Recorder() { stop(); }

  void start();
  // Writes the waiting rows and ends the thread.
  void stop();
  // Does the same as stop(), for at most `patience`. Returns false if the disk hangs.
  bool stop_for(std::chrono::milliseconds patience);

  // Queues rows of a loop in their order, without waiting. For one thread only.
  void push(std::size_t loop, std::span<const record::RecordRow> rows) noexcept;

  // Waits for the disk for at most `patience`. From any thread.
  RecorderStatus status(std::size_t loop) const;
  // Starts a CSV record and returns its path. Throws std::runtime_error on failure. If the disk
  // does not answer in time, it throws too and no record is made.
  std::string start_csv(std::size_t loop, const std::string& name,
                        std::chrono::milliseconds patience);
  // Ends the record and returns its path; empty if there was no record. Throws std::runtime_error
  // if the record is incomplete. If the disk does not answer in time, it throws too, and the record
  // is completed when the disk answers.
  std::string stop_csv(std::size_t loop, std::chrono::milliseconds patience);
  // Returns the folder of a loop's segments.
  std::filesystem::path segments_folder(const std::string& loop) const {
    return settings_.state_directory / "segments" / loop;
  }
  // Returns how long the disk has not answered, s; 0: no call is waiting.
  double disk_wait_s() const noexcept { return wait_.seconds(); }
  // Returns the time between two syncs, s; 0 before it is known.
  double sync_s() const noexcept {
    return static_cast<double>(sync_ms_.load(std::memory_order_relaxed)) / 1000.0;
  }

 private:
  enum class CsvState : std::uint8_t { none, starting, recording, stopping };
  struct CsvOrder {
    bool start = false;
    std::uint64_t after = 0;  // rows that were queued before this request
  };
  struct Csv {
    CsvState state = CsvState::none;
    bool cancelled = false;  // its requester no longer waits for the start
    std::filesystem::path file;
    std::string error;
    std::list<CsvOrder> orders;
  };
  // Data shared with other threads.
  struct Track {
    std::vector<record::RecordRow> waiting;
    std::uint64_t queued = 0;  // number of rows since the start
    std::uint64_t dropped = 0;
    std::size_t room = 0;
    record::SegmentStatus segments;
    Csv csv;
  };
  // For the recorder's thread only.
  struct Disk {
    std::unique_ptr<record::SegmentWriter> segments;
    std::unique_ptr<record::RecordCsvWriter> csv;
    std::uint64_t first_period = 0;
    std::uint64_t next_period = 0;
    bool begun = false;  // the CSV record has a row
  };

  void run();
  void open_segments(std::size_t loop);
  void write_loop(std::size_t loop);
  std::chrono::milliseconds choose_sync() const;
  void sync_if_due();
  void publish_status();
  std::optional<CsvOrder> next_order(std::size_t loop, std::uint64_t end);
  void write_csv(std::size_t loop, std::span<const record::RecordRow> rows);
  void add_rows(std::size_t loop, std::span<const record::RecordRow> rows);
  void carry_out(std::size_t loop, bool start);
  void begin_csv(std::size_t loop);
  void end_csv(std::size_t loop);
  void settle(std::size_t loop, const std::string& error);

  std::vector<LoopRuntime>& loops_;
  RecorderSettings settings_;
  base::DiskWait wait_;

  mutable std::mutex mutex_;  // held for copies in memory only
  std::condition_variable changed_;
  std::vector<Track> tracks_;
  bool urgent_ = false;  // a requester waits for a start or an end
  bool quit_ = false;

  std::vector<Disk> disks_;
  std::vector<record::RecordRow> batch_;  // of the loop being served
  std::vector<record::SegmentWriter*> writers_;
  std::atomic<std::int64_t> sync_ms_{0};
  std::chrono::steady_clock::time_point next_sync_;
  base::Thread thread_;
};

}  // namespace loopwarden::daemon
