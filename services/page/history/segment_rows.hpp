// SPDX-License-Identifier: Apache-2.0
// A segment file; rows are read on demand. Unlike record::read_segment, which takes it whole.
#pragma once

#include <cstddef>
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
  // Throws record::RecordError for what is no segment, or can't be read.
  explicit SegmentRows(const std::filesystem::path& path);

  const record::SegmentHeader& header() const noexcept { return decoded_.header; }
  std::uint32_t places() const noexcept { return places_; }

  // Undamaged rows of the places [first, last), in order; false from `each` ends it.
  using Each =
      std::function<bool(const record::RecordRow& row, std::int64_t utc_ms, std::uint32_t place)>;
  void read(std::uint32_t first, std::uint32_t last, const Each& each) const;
  // The first place whose row is not before `utc_ms`; damaged ones are stepped over. The clock within a segment never
  // goes back.
  std::uint32_t place_of(std::int64_t utc_ms) const;
  // UTC of the first undamaged row at or behind `place`.
  std::optional<std::int64_t> time_at(std::uint32_t place) const;
  // The last undamaged row, as a block of its own.
  std::optional<Block> last() const;

 private:
  std::filesystem::path path_;
  base::File file_;
  record::DecodedHeader decoded_;
  std::uint32_t places_ = 0;
};

}  // namespace loopwarden::page::history
