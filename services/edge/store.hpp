// SPDX-License-Identifier: Apache-2.0
// What waits for broker or host, in a SQLite database: bounded, the oldest goes first and is counted. Also bdSeq, which
// must outlive the program.
//
// One transaction a call, journal_mode=WAL, synchronous=NORMAL: a power failure may take back the newest calls, never
// more, and leaves the file sound. A file that is damaged or not ours is moved aside; one of another version is an
// error, and stays.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/net/sparkplug/payload.hpp"
#include "base/sqlite/sqlite.hpp"

namespace loopwarden::edge {

// Values of one device, of one moment; metrics carry name, type and time.
struct Report {
  std::string device;  // empty: of the edge node
  std::vector<sparkplug::Metric> metrics;
};

class Store {
 public:
  // Opens or makes the file. Throws sqlite::Error if that fails, std::filesystem::filesystem_error if a damaged one can't
  // be moved.
  Store(const std::filesystem::path& file, std::uint64_t most_bytes);
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  // All of them behind what is there, or sqlite::Error (disk full). Drops the oldest beyond the bound.
  void append(const std::vector<Report>& reports);

  struct Row {
    std::int64_t id = 0;
    Report report;
  };
  // The oldest with an id above `after`. A row that can't be decoded is put into table `unreadable`, and counted as
  // dropped.
  std::vector<Row> read(std::int64_t after, std::size_t most);
  void remove_up_to(std::int64_t id);

  std::uint64_t waiting() const noexcept { return waiting_; }  // reports
  std::uint64_t dropped() const noexcept { return dropped_; }  // reports, ever

  std::optional<std::uint8_t> bd_seq();
  void keep_bd_seq(std::uint8_t bd_seq);

 private:
  void drop_oldest();
  void set_aside(std::int64_t id, const std::string& why);
  void count();
  void keep(const char* name, std::int64_t value);
  std::optional<std::int64_t> kept(const char* name);

  sqlite::Database database_;
  std::uint64_t most_bytes_;
  std::uint64_t bytes_ = 0;
  std::uint64_t waiting_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace loopwarden::edge
