// SPDX-License-Identifier: Apache-2.0
#include "services/page/history/summary.hpp"

#include <fmt/format.h>

namespace loopwarden::page::history {
namespace {

void add(std::vector<Block>& level, const Block& block, std::uint32_t most_rows) {
  if (level.empty() || level.back().rows + block.rows > most_rows ||
      gap_between(level.back(), block)) {
    level.push_back(block);
  } else {
    append(level.back(), block);
  }
}

}  // namespace

Summary summarise(const SegmentRows& rows) {
  Summary summary;
  rows.read(0, rows.places(),
            [&](const record::RecordRow& row, std::int64_t utc_ms, std::uint32_t place) {
              add(summary.levels[0], block_of(row, utc_ms, rows.header().run, place),
                  kBlockRows[0]);
              return true;
            });
  for (const Block& block : summary.levels[0]) add(summary.levels[1], block, kBlockRows[1]);
  for (auto& level : summary.levels) level.shrink_to_fit();
  return summary;
}

std::shared_ptr<const Summary> SummaryStore::get(const std::filesystem::path& path,
                                                 const SegmentRows& rows) {
  // The time is part of the key: an emptied state directory counts from 1 again.
  const std::string key =
      fmt::format("{} {} {}", path.string(), rows.header().start_utc_ns, rows.places());
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = index_.find(key); found != index_.end()) {
      entries_.splice(entries_.begin(), entries_, found->second);
      return found->second->summary;
    }
  }
  auto summary = std::make_shared<const Summary>(summarise(rows));
  const std::lock_guard lock(mutex_);
  if (index_.contains(key)) return summary;
  entries_.push_front({key, summary});
  index_[key] = entries_.begin();
  bytes_ += summary->bytes();
  while (bytes_ > most_bytes_ && entries_.size() > 1) {
    bytes_ -= entries_.back().summary->bytes();
    index_.erase(entries_.back().key);
    entries_.pop_back();
  }
  return summary;
}

std::size_t SummaryStore::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

}  // namespace loopwarden::page::history
