// SPDX-License-Identifier: Apache-2.0
// What a message is in the tables. Metrics are named by the device's book, since the database gives numbers to those of
// a birth only when it is written.
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
  std::size_t metric = 0;  // in book->metrics
  std::int64_t time_ms = 0;
  std::optional<double> number{};
  std::optional<std::string> text{};
  bool of_birth = false;    // kept only if it differs from the newest
  bool historical = false;  // newest only where nothing newer is known
  bool transient = false;   // newest value only
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
  std::string request;  // what it answers; empty: the edge node does not say
  std::string folder;   // empty: as above
  int files = 0;        // of the folder, that come; 0: as above
  std::string name;
  std::string sha256;  // of the whole file, hexadecimal
  int part = 0;
  int parts = 0;
  std::string bytes;
};

// The box will not send what it was asked for.
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
  std::size_t unknown_metrics = 0;  // no birth gave them: something was missed
  std::size_t bad_times = 0;        // replaced by the time of receipt
};

inline constexpr std::size_t kLongestText = 8192;  // bytes of a value; the rest is cut off
inline constexpr int kMostParts = 4096;            // of a file

// Appends the rows of a birth or of data. `book` is the device's newest.
ReduceOutcome reduce(const Message& message, const BookPointer& book, Rows& rows);

}  // namespace loopwarden::fleet
