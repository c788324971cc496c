// SPDX-License-Identifier: Apache-2.0
#include "services/page/history/history.hpp"

#include <algorithm>
#include <memory>

#include "record/record_csv.hpp"
#include "record/segment_reader.hpp"

namespace loopwarden::page::history {
namespace {

// Buckets of fewer blocks would show the edges of blocks.
constexpr double kBlocksPerBucket = 4.0;
constexpr std::size_t kRowsPerPiece = 4096;

}  // namespace

// The part of a segment that is within the stretch.
struct History::Part {
  std::filesystem::path path;
  std::shared_ptr<SegmentRows> rows;
  std::uint32_t first = 0;  // places
  std::uint32_t last = 0;
  double ms_per_row = 0.0;  // of the whole segment
  bool ended = false;
};

struct History::Parts {
  std::vector<Part> segments;
  std::vector<Block> tail;      // newer rows
  std::optional<Block> newest;  // row of the segments

  std::size_t rows() const {
    std::size_t sum = tail.size();
    for (const Part& part : segments) sum += part.last - part.first;
    return sum;
  }
};

History::Parts History::parts_of(const std::filesystem::path& folder, const Stretch& stretch,
                                 Past& past) {
  Parts parts;
  const auto files = record::list_segments(folder);
  for (const record::SegmentFile& file : files) {
    try {
      auto rows = std::make_shared<SegmentRows>(file.path);
      const std::optional<std::int64_t> first_ms = rows->time_at(0);
      const std::optional<Block> last = rows->last();
      if (!first_ms || !last) continue;
      past.oldest_ms = std::min(past.oldest_ms.value_or(*first_ms), *first_ms);
      if (!parts.newest || last->last_ms > parts.newest->last_ms) parts.newest = last;
      if (*first_ms > stretch.to_ms || last->last_ms < stretch.from_ms) continue;
      Part part{.path = file.path, .rows = rows, .last = rows->places()};
      if (*first_ms < stretch.from_ms) part.first = rows->place_of(stretch.from_ms);
      if (last->last_ms > stretch.to_ms) part.last = rows->place_of(stretch.to_ms + 1);
      part.ms_per_row =
          static_cast<double>(last->last_ms - *first_ms) / std::max(1U, last->first_row);
      part.ended = &file != &files.back();
      parts.segments.push_back(std::move(part));
    } catch (const record::RecordError& e) {
      past.unreadable.emplace_back(e.what());
    }
  }
  if (parts.newest) past.newest_ms = parts.newest->last_ms;
  return parts;
}

void History::add(const Part& part, double bucket_ms, Decimator& decimator) {
  const std::uint64_t run = part.rows->header().run;
  const auto add_rows = [&](std::uint32_t first, std::uint32_t last) {
    part.rows->read(first, last,
                    [&](const record::RecordRow& row, std::int64_t utc_ms, std::uint32_t place) {
                      decimator.add(block_of(row, utc_ms, run, place));
                      return true;
                    });
  };
  std::size_t level = kLevels;
  while (level > 0 && bucket_ms < kBlocksPerBucket * part.ms_per_row * kBlockRows[level - 1])
    --level;
  if (level == 0 || bucket_ms <= 0.0) return add_rows(part.first, part.last);
  const std::shared_ptr<const Summary> summary =
      part.ended ? summaries_.get(part.path, *part.rows)
                 : std::make_shared<const Summary>(summarise(*part.rows));
  // Blocks that extend beyond the stretch are read row by row.
  for (const Block& block : summary->levels[level - 1]) {
    if (block.end_row <= part.first || block.first_row >= part.last) continue;
    if (block.first_row >= part.first && block.end_row <= part.last) {
      decimator.add(block);
    } else {
      add_rows(std::max(block.first_row, part.first), std::min(block.end_row, part.last));
    }
  }
}

Curves History::curves(const Parts& parts, const Stretch& stretch, double bucket_ms) {
  Decimator decimator(stretch.from_ms, bucket_ms);
  for (const Part& part : parts.segments) add(part, bucket_ms, decimator);
  for (const Block& row : parts.tail) decimator.add(row);
  return decimator.take();
}

Past History::past(const std::filesystem::path& folder, const Stretch& stretch, std::size_t points,
                   const Newer& newer) {
  Past past;
  Parts parts = parts_of(folder, stretch, past);
  parts.tail = newer(parts.newest);
  for (Block& row : parts.tail) row.run = parts.newest ? parts.newest->run : 0;
  if (!parts.tail.empty()) {
    past.newest_ms = parts.tail.back().last_ms;
    past.oldest_ms = past.oldest_ms.value_or(parts.tail.front().first_ms);
  }
  std::erase_if(parts.tail, [&](const Block& row) {
    return row.first_ms < stretch.from_ms || row.first_ms > stretch.to_ms;
  });
  points = std::clamp<std::size_t>(points, kRowsPerBucket, kMostPoints);
  if (parts.rows() <= points) {
    past.curves = curves(parts, stretch, 0.0);
    // Gaps add rows.
    if (past.curves.t_ms.size() <= points) return past;
  }
  past.bucket_ms = static_cast<double>(stretch.to_ms - stretch.from_ms + 1) /
                   static_cast<double>(points / kRowsPerBucket);
  past.curves = curves(parts, stretch, *past.bucket_ms);
  return past;
}

RowReader::RowReader(const std::filesystem::path& folder, const Stretch& stretch)
    : stretch_(stretch) {
  for (record::SegmentFile& file : record::list_segments(folder)) {
    segments_.push_back(std::move(file.path));
  }
}

std::vector<RowReader::Row> RowReader::next() {
  std::vector<Row> found;
  while (found.empty() && segment_ < segments_.size()) {
    try {
      const SegmentRows rows(segments_[segment_]);
      if (!placed_) place_ = rows.place_of(stretch_.from_ms);
      placed_ = true;
      const std::uint32_t end = place_ + static_cast<std::uint32_t>(kRowsPerPiece);
      rows.read(place_, end, [&](const record::RecordRow& row, std::int64_t utc_ms, std::uint32_t) {
        if (utc_ms >= stretch_.from_ms && utc_ms <= stretch_.to_ms) {
          found.push_back({row, utc_ms, rows.header().run, rows.header().period_s});
        }
        return utc_ms <= stretch_.to_ms;
      });
      place_ = end;
      if (end < rows.places() && (found.empty() || found.back().utc_ms < stretch_.to_ms)) continue;
    } catch (const record::RecordError&) {
      // An unreadable segment is skipped.
    }
    ++segment_;
    placed_ = false;
  }
  return found;
}

}  // namespace loopwarden::page::history
