// SPDX-License-Identifier: Apache-2.0
// Records on the box: a ring of segment files of limited size, one folder per loop.
//
// Segments are only appended to. After a power failure a torn tail is recognised by its CRCs, and
// one damaged row loses one row. A restart of the daemon begins a new segment and a new run. The
// oldest segment is deleted if the next one would exceed the limit.
//
// Flash memory lasts longer with few, large writes. Rows therefore wait in memory until sync_all()
// writes them, and each segment's space is allocated when the segment begins. A row that is written
// at once would change the times of its file, and the file system would store them every few
// seconds.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/file.hpp"
#include "record/record_row.hpp"
#include "record/segment_reader.hpp"

namespace loopwarden::record {

struct SegmentSettings {
  std::filesystem::path folder;  // of this loop only; created with the first row
  std::string loop;              // at most 63 bytes are kept
  double period_s = 0.1;         // s, sampling period of the loop
  std::size_t limit_bytes = 64UL * 1024UL * 1024UL;  // of all segments together, at least 64 KiB
  std::size_t most_pending = 256;  // rows in memory; more are written before the next sync_all()
  std::chrono::milliseconds retry_interval{5000};  // after a disk error
};

struct SegmentStatus {
  std::uint64_t rows = 0;       // passed to the disk
  std::uint64_t pending = 0;    // in memory
  std::uint64_t rows_lost = 0;  // refused by the disk
  std::uint64_t disk_errors = 0;
  std::uint64_t segments_dropped = 0;  // to keep the limit, or to free space on a full disk
  std::uint64_t syncs = 0;
  std::size_t bytes = 0;           // of all segments together
  std::int64_t oldest_utc_ms = 0;  // of the oldest row kept; 0: no rows
  std::string last_error;          // empty: no error so far
};

// The recorder of one loop. Used by one thread. Only the constructor throws, because a recorder
// with a fault must not affect the loop.
class SegmentWriter {
 public:
  // Throws RecordError if the folder can't be read, or the period is not positive.
  explicit SegmentWriter(SegmentSettings settings);
  SegmentWriter(const SegmentWriter&) = delete;
  SegmentWriter& operator=(const SegmentWriter&) = delete;
  ~SegmentWriter();

  // Takes rows in the order of their cycles.
  void append(std::span<const RecordRow> rows) noexcept;
  // Writes the pending rows of all writers and waits until the disk has them. The file system
  // stores the changed metadata of all files in one transaction.
  static void sync_all(std::span<SegmentWriter* const> writers) noexcept;
  SegmentStatus status() const;

 private:
  void write_pending() noexcept;
  void write_all(std::span<const RecordRow> rows);
  void start_writing(unsigned flags) const noexcept;
  bool write_rows(std::span<const RecordRow> rows);
  bool begin_segment(const RecordRow& first);
  bool create_segment(const RecordRow& first);
  void end_segment() noexcept;
  bool sync() noexcept;
  bool make_room() noexcept;
  bool drop_oldest() noexcept;
  void look_for_oldest() noexcept;
  std::size_t bytes_of_all() const noexcept;
  std::size_t bytes_of_open() const noexcept;  // disk space
  std::size_t bytes_of_rows() const noexcept;  // of the open segment's file
  void failed(const char* step, int error) noexcept;

  SegmentSettings settings_;
  std::uint32_t rows_per_segment_;
  std::deque<SegmentFile> ended_;  // oldest first
  std::uint64_t next_sequence_ = 1;
  std::uint64_t run_ = 0;  // sequence of this run's first segment; 0: not yet set

  base::File file_;
  std::filesystem::path path_;  // of the open segment, as the three members below
  std::uint64_t sequence_ = 0;
  std::uint32_t header_crc_ = 0;
  std::uint32_t rows_in_segment_ = 0;
  std::vector<RecordRow> pending_;
  bool unsynced_ = false;
  // A full disk costs one old segment for each new one. Otherwise another program that uses the
  // freed space could cost the whole history.
  bool may_make_room_ = true;
  std::optional<std::chrono::steady_clock::time_point> retry_at_;

  SegmentStatus status_;  // status() creates its text
  const char* failed_step_ = nullptr;
  int failed_errno_ = 0;
};

}  // namespace loopwarden::record
