// SPDX-License-Identifier: Apache-2.0
// Converts a message into rows of the tables. Rows refer to metrics by the device's book, because
// the database assigns numbers to a birth's metrics only when the birth is written.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/fleet/host/device_book.hpp"
#include "services/net/sparkplug/edge_tracker.hpp"

namespace loopwarden::fleet {

using sparkplug::Message;

using BookPointer = std::shared_ptr<DeviceBook>;

struct ValueRow {
  BookPointer book;
  std::size_t metric = 0;  // index in book->metrics
  std::int64_t time_ms = 0;
  std::optional<double> number{};
  std::optional<std::string> text{};
  bool of_birth = false;    // stored only if it differs from the newest
  bool historical = false;  // newest only if no newer value is stored
  bool transient = false;   // updates the newest value only
};

struct AlarmRow {
  BookPointer book;
  std::string name;
  std::int64_t time_ms = 0;
  std::string state;
  std::optional<double> severity{};
};

struct ExplanationRow {
  BookPointer book;
  std::int64_t time_ms = 0;
  std::string parts;  // JSON object
};

struct FilePartRow {
  BookPointer book;
  std::string request;  // answered request; empty: the edge node does not name it
  std::string folder;   // empty: not named
  int files = 0;        // number of files in the folder; 0: not given
  std::string name;
  std::string sha256;  // of the whole file, in hexadecimal
  int part = 0;
  int parts = 0;
  std::string bytes;
};

// The box refuses to send the requested data.
struct RefusalRow {
  BookPointer book;
  std::string request;
  std::string why;
};

struct Rows {
  std::vector<ValueRow> values;
  std::vector<AlarmRow> alarms;
  std::vector<ExplanationRow> explanations;
  std::vector<FilePartRow> file_parts;
  std::vector<RefusalRow> refusals;
};

struct ReduceOutcome {
  std::size_t unknown_metrics = 0;  // absent from the birth: a message was missed
  std::size_t bad_times = 0;        // replaced by the time of receipt
};

inline constexpr std::size_t kLongestText = 8192;  // bytes of a value; the remainder is cut off
inline constexpr int kMostParts = 4096;            // per file

// Appends the rows of a birth or of data. `book` is the device's newest book.
ReduceOutcome reduce(const Message& message, const BookPointer& book, Rows& rows);

}  // namespace loopwarden::fleet
