// SPDX-License-Identifier: Apache-2.0
// Holds messages from the broker until they are in the database, oldest first. Messages are in
// memory, and on the disk while the database is unavailable or slow. The size is limited: beyond
// the limit the oldest file is dropped and counted.
//
// A file is kept until all its messages are in the database. After a kill its messages are read
// again, including written ones; the tables' keys make that harmless. A kill loses messages that
// are in memory only (the edges send the last minute again), but none on the disk. A power failure
// loses at most the last second on the disk.
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
  bool left_over = false;        // received by an earlier run of the program
  friend bool operator==(const Arrival&, const Arrival&) = default;
};

struct SpoolSettings {
  std::filesystem::path folder;
  std::uint64_t limit_bytes = 1024ULL * 1024ULL * 1024ULL;  // on the disk
  std::size_t memory_bytes = 32UL * 1024UL * 1024UL;  // limit; further messages go to the disk
  std::size_t file_bytes = 8UL * 1024UL * 1024UL;
};

class Spool {
 public:
  // Takes over the files of an earlier run. A damaged record ends its file. Throws
  // std::runtime_error if the folder can't be created.
  explicit Spool(SpoolSettings settings);
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;

  // Appends a message. If the disk fails, messages stay in memory up to that limit; further ones
  // are dropped and counted.
  void push(Arrival arrival);
  // Returns the oldest messages: at most `most`, and at most kMostPeekedBytes except for the first.
  // They stay until pop().
  static constexpr std::size_t kMostPeekedBytes = 2UL * 1024UL * 1024UL;
  std::vector<Arrival> peek(std::size_t most);
  // Removes the messages of the last peek().
  void pop();
  // Moves messages in memory to the disk because the database is unavailable. New messages also go
  // there until all are read.
  void to_disk();
  // Syncs the disk. A power failure then loses only messages received since.
  void sync();

  bool empty() const;
  std::uint64_t disk_bytes() const;
  std::uint64_t waiting() const;  // messages, including files of an earlier run
  std::uint64_t dropped() const;
  // Returns the used share of the limit on the disk, 0 to 1.
  double fill() const;

 private:
  struct File {
    std::filesystem::path path;
    std::uint64_t bytes = 0;
    std::uint64_t read = 0;  // offset up to which messages are in the database
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
      // oldest first; if there are files, memory_ holds only messages that the disk refused
      files_;
  std::ofstream writer_;  // for the newest file
  std::uint64_t next_number_ = 1;
  std::uint64_t dropped_ = 0;
  // By the newest peek().
  std::size_t peeked_ = 0;
  bool peeked_disk_ = false;
  std::filesystem::path peeked_file_;
  std::uint64_t peeked_to_ = 0;
};

}  // namespace loopwarden::fleet
