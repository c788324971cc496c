// SPDX-License-Identifier: Apache-2.0
// What came from the broker and is not in the database yet, oldest first: in memory, and on the disk while the
// database is away or slow. Bounded: beyond the limit the oldest file is dropped and counted.
//
// A file lives until all of it is in the database; after a kill its messages are read again, those that had been
// written as well, which the tables' keys make harmless. What is in memory only is lost by a kill (the edges send the
// last minute again); what is on the disk is not, and after a power failure but for the last second.
//
// One thread may append while another one reads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <string>
#include <vector>

namespace loopwarden::fleet {

struct Arrival {
  std::string topic;
  std::string payload;
  std::int64_t received_ms = 0;  // since 1970, UTC
  bool left_over = false;        // by an earlier run of the program
  friend bool operator==(const Arrival&, const Arrival&) = default;
};

struct SpoolSettings {
  std::filesystem::path folder;
  std::uint64_t limit_bytes = 1024ULL * 1024ULL * 1024ULL;  // on the disk
  std::size_t memory_bytes = 32UL * 1024UL * 1024UL;        // beyond it messages go to the disk
  std::size_t file_bytes = 8UL * 1024UL * 1024UL;
};

class Spool {
 public:
  // Takes over what an earlier run left; a record that is damaged ends its file. Throws std::runtime_error where the
  // folder can't be made.
  explicit Spool(SpoolSettings settings);
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;

  // Where the disk refuses, it stays in memory up to the limit there, beyond it is dropped and counted.
  void push(Arrival arrival);
  // The oldest ones, at most `most` and, but for the first, at most kMostPeekedBytes; they stay until dropped.
  static constexpr std::size_t kMostPeekedBytes = 2UL * 1024UL * 1024UL;
  std::vector<Arrival> peek(std::size_t most);
  // Those that peek() gave.
  void pop();
  // The database is away: what is in memory goes to the disk, and what comes too until all is read.
  void to_disk();
  // So that a power failure takes no more than what came since.
  void sync();

  bool empty() const;
  std::uint64_t disk_bytes() const;
  std::uint64_t waiting() const;  // messages, of files of an earlier run too
  std::uint64_t dropped() const;
  // Share of the limit on the disk in use, 0 to 1.
  double fill() const;

 private:
  struct File {
    std::filesystem::path path;
    std::uint64_t bytes = 0;
    std::uint64_t read = 0;  // offset behind what is in the database
    std::uint64_t messages = 0;
    bool left_over = false;
  };
  void take_over_files();
  bool append(const Arrival& arrival);
  bool open_file();
  bool spill();
  void drop_oldest();
  void sync_file();
  std::uint64_t bytes_on_disk() const;
  std::vector<Arrival> peek_disk(std::size_t most);
  void remove_front();

  const SpoolSettings settings_;
  mutable std::mutex mutex_;
  std::deque<Arrival> memory_;
  std::size_t memory_bytes_ = 0;
  std::deque<File>
      files_;             // oldest first; while there are any, memory_ holds what the disk refused
  std::ofstream writer_;  // of the newest
  std::uint64_t next_number_ = 1;
  std::uint64_t dropped_ = 0;
  // Of the newest peek().
  std::size_t peeked_ = 0;
  bool peeked_disk_ = false;
  std::filesystem::path peeked_file_;
  std::uint64_t peeked_to_ = 0;
};

}  // namespace loopwarden::fleet
