// SPDX-License-Identifier: Apache-2.0
// Writes what the historian hands over to the disk, with a thread of its own: the ring of segments, and
// CSV records where they were asked for.
//
// Nobody waits for the disk: rows go into a bounded queue in memory, which bridges a minute or two;
// what finds no room is dropped and counted. The watchdog does not judge this thread.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
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
  double queue_s = 120.0;                           // s of each loop, that the disk may be late
  std::size_t queue_bytes = 8UL * 1024UL * 1024UL;  // of all loops together
};

// What the recorder knows of one loop.
struct RecorderStatus {
  std::size_t waiting = 0;          // rows in the queue
  std::uint64_t queue_dropped = 0;  // rows that found no room in the queue
  record::SegmentStatus segments;
  std::string csv_file;   // empty: no CSV record is being written
  std::string csv_error;  // why the last CSV record is incomplete; empty: it is not
};

class Recorder {
 public:
  Recorder(std::vector<LoopRuntime>& loops, RecorderSettings settings);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  ~Recorder() { stop(); }

  void start();
  // Writes what is waiting and ends the thread.
  void stop();
  // As stop(), for at most `patience`; false if the disk hangs.
  bool stop_for(std::chrono::milliseconds patience);

  // One thread: takes rows of a loop in their order, without waiting.
  void push(std::size_t loop, std::span<const record::RecordRow> rows) noexcept;

  // Any thread. The disk is waited for no longer than `patience`.
  RecorderStatus status(std::size_t loop) const;
  // Begins a CSV record; returns its path. Throws std::runtime_error, also if the disk does not
  // answer in time: then there will be no record.
  std::string start_csv(std::size_t loop, const std::string& name,
                        std::chrono::milliseconds patience);
  // Ends it; returns its path, empty if there was none. Throws std::runtime_error if it is incomplete,
  // or if the disk does not answer in time: then it is completed once the disk does.
  std::string stop_csv(std::size_t loop, std::chrono::milliseconds patience);
  // Where a loop's segments lie.
  std::filesystem::path segments_folder(const std::string& loop) const {
    return settings_.state_directory / "segments" / loop;
  }
  // For how long the disk has not answered, s; 0: nothing is asked of it.
  double disk_wait_s() const noexcept { return wait_.seconds(); }

 private:
  enum class CsvState : std::uint8_t { none, starting, recording, stopping };
  struct CsvOrder {
    bool start = false;
    std::uint64_t after = 0;  // rows that were queued before it
  };
  struct Csv {
    CsvState state = CsvState::none;
    bool cancelled = false;  // nobody waits for its start any more
    std::filesystem::path file;
    std::string error;
    std::deque<CsvOrder> orders;
  };
  // Everything that others look at.
  struct Track {
    std::vector<record::RecordRow> waiting;
    std::uint64_t queued = 0;  // rows ever
    std::uint64_t dropped = 0;
    std::size_t room = 0;
    record::SegmentStatus segments;
    Csv csv;
  };
  // Only the recorder's thread touches it.
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
  bool urgent_ = false;  // somebody waits for an order
  bool quit_ = false;

  std::vector<Disk> disks_;
  std::vector<record::RecordRow> batch_;  // of the loop being served
  base::Thread thread_;
};

}  // namespace loopwarden::daemon
