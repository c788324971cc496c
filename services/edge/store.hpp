// SPDX-License-Identifier: Apache-2.0
// Stores the reports that wait for broker or host in a SQLite database. It is bounded: the oldest
// reports are dropped first and counted. It also keeps bdSeq, which must survive a restart.
//
// Each call is one transaction, journal_mode=WAL, synchronous=NORMAL. A power failure may undo the
// newest calls, never more, and leaves the file sound. A damaged or foreign file is moved aside. A
// file of another version is an error and is kept.
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

// Values of one device at one moment; metrics carry name, type and time.
struct Report {
  std::string device;  // empty: of the edge node
  std::vector<sparkplug::Metric> metrics;
};

class Store {
 public:
  // Opens or makes the file. Throws sqlite::Error if that fails, std::filesystem::filesystem_error
  // if a damaged file can't be moved.
  Store(const std::filesystem::path& file, std::uint64_t most_bytes);
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  // Appends all reports, or throws sqlite::Error (disk full). Drops the oldest beyond the limit.
  void append(const std::vector<Report>& reports);

  struct Row {
    std::int64_t id = 0;
    Report report;
  };
  // Returns the oldest rows with an id above `after`. A row that can't be decoded is moved to the
  // table `unreadable` and counted as dropped.
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
