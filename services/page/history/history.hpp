// SPDX-License-Identifier: Apache-2.0
// Returns a loop's past, from the recorder's segments.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "services/page/history/decimator.hpp"
#include "services/page/history/segment_rows.hpp"
#include "services/page/history/summary.hpp"

namespace loopwarden::page::history {

struct Stretch {
  std::int64_t from_ms = 0;  // UTC
  std::int64_t to_ms = 0;    // inclusive
};

struct Past {
  Curves curves;
  std::optional<double> bucket_ms;        // nullopt: every row is included
  std::optional<std::int64_t> oldest_ms;  // of all kept rows; nullopt if there are no rows
  std::optional<std::int64_t> newest_ms;
  std::vector<std::string> unreadable;  // one text for each segment that could not be used
};

// Returns rows newer than `newest`, the newest row of the segments. Each is a block, in the order
// of time. Their run is not needed.
using Newer = std::function<std::vector<Block>(const std::optional<Block>& newest)>;

inline constexpr std::size_t kMostPoints = 4000;

class History {
 public:
  // Returns at most `points` rows. A segment that can't be read is skipped. Throws
  // record::RecordError if the folder can't be read.
  Past past(const std::filesystem::path& folder, const Stretch& stretch, std::size_t points,
            const Newer& newer);

  std::size_t bytes() const { return summaries_.bytes(); }

 private:
  struct Part;
  struct Parts;
  static Parts parts_of(const std::filesystem::path& folder, const Stretch& stretch, Past& past);
  void add(const Part& part, double bucket_ms, Decimator& decimator);
  Curves curves(const Parts& parts, const Stretch& stretch, double bucket_ms);

  SummaryStore summaries_;
};

// Reads every row of a stretch, piece by piece.
class RowReader {
 public:
  RowReader(const std::filesystem::path& folder, const Stretch& stretch);

  struct Row {
    record::RecordRow row;
    std::int64_t utc_ms = 0;
    std::uint64_t run = 0;
    double period_s = 0.0;
  };
  // Returns the next rows, some thousand; empty at the end.
  std::vector<Row> next();

 private:
  Stretch stretch_;
  std::vector<std::filesystem::path> segments_;
  std::size_t segment_ = 0;
  std::uint32_t place_ = 0;
  bool placed_ = false;
};

}  // namespace loopwarden::page::history
