// SPDX-License-Identifier: Apache-2.0
// Reads rows of a segment file on demand, whereas record::read_segment reads the whole file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>

#include "services/page/history/block.hpp"
#include "base/file.hpp"
#include "record/segment_format.hpp"

namespace loopwarden::page::history {

class SegmentRows {
 public:
  // Throws record::RecordError if the file is not a segment, or can't be read.
  explicit SegmentRows(const std::filesystem::path& path);

  const record::SegmentHeader& header() const noexcept { return decoded_.header; }
  std::uint32_t places() const noexcept { return places_; }

  // Calls `each` for the undamaged rows of places [first, last), in order, until it returns false.
  using Each =
      std::function<bool(const record::RecordRow& row, std::int64_t utc_ms, std::uint32_t place)>;
  void read(std::uint32_t first, std::uint32_t last, const Each& each) const;
  // Returns the first place whose row is not before `utc_ms`; damaged rows are skipped. Within a
  // segment the clock never decreases.
  std::uint32_t place_of(std::int64_t utc_ms) const;
  // Returns the UTC of the first undamaged row at or after `place`.
  std::optional<std::int64_t> time_at(std::uint32_t place) const;
  // Returns the last undamaged row, as a separate block.
  std::optional<Block> last() const;

 private:
  std::filesystem::path path_;
  base::File file_;
  record::DecodedHeader decoded_;
  std::uint32_t places_ = 0;
};

}  // namespace loopwarden::page::history
