// SPDX-License-Identifier: Apache-2.0
// Exports the segments of a box as CSV records.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace loopwarden::record {

struct ExportSettings {
  std::optional<std::int64_t> from_utc_ns;
  std::optional<std::int64_t> to_utc_ns;  // rows before this moment
  // A gap of at most this many periods becomes rows with empty cells. A longer gap ends the file.
  std::uint64_t longest_filled_gap = 600;
  // Returns where to write the file of this final path. Default: the path itself.
  std::function<std::filesystem::path(const std::filesystem::path&)> place{};
};

struct ExportedRecord {
  std::filesystem::path path;
  std::int64_t start_utc_ns = 0;
  std::size_t rows = 0;         // including filled rows
  std::size_t filled_rows = 0;  // empty, for missing cycles
};

struct ExportResult {
  std::vector<ExportedRecord> records;
  std::size_t single_rows = 0;  // left out: a single row has no period
  std::size_t damaged_rows = 0;
  std::size_t torn_bytes = 0;
  std::vector<std::string> unreadable;  // one text per segment that could not be used
};

// Exports a folder of segments as `<loop>_<UTC of the first row>.csv` into `target`, which is
// created if missing and `place` is not set. Each file is a record of constant period: a restart,
// another period or a long gap begins a new file. Time counts from the file's first row. The loop's
// additional states follow the columns of a record, as numbers. Throws RecordError.
ExportResult export_csv(const std::filesystem::path& folder, const std::filesystem::path& target,
                        const ExportSettings& settings = {});

}  // namespace loopwarden::record
