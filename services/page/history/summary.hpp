// SPDX-License-Identifier: Apache-2.0
// Summarises a segment's rows by ends and extremes, in blocks of two sizes. A bounded store.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "services/page/history/block.hpp"
#include "services/page/history/segment_rows.hpp"

namespace loopwarden::page::history {

inline constexpr std::size_t kLevels = 2;
inline constexpr std::array<std::uint32_t, kLevels> kBlockRows{64, 2048};

// Blocks never extend across a gap.
struct Summary {
  std::array<std::vector<Block>, kLevels> levels;

  std::size_t bytes() const noexcept {
    return sizeof *this + (levels[0].size() + levels[1].size()) * sizeof(Block);
  }
};

Summary summarise(const SegmentRows& rows);

// Keeps the summaries of segments that have ended, because these never change. The least recently
// used one is dropped first. Any thread.
class SummaryStore {
 public:
  explicit SummaryStore(std::size_t most_bytes = 64UL * 1024UL * 1024UL)
      : most_bytes_(most_bytes) {}

  std::shared_ptr<const Summary> get(const std::filesystem::path& path, const SegmentRows& rows);
  std::size_t bytes() const;

 private:
  struct Entry {
    std::string key;
    std::shared_ptr<const Summary> summary;
  };
  mutable std::mutex mutex_;
  std::size_t most_bytes_;
  std::size_t bytes_ = 0;
  std::list<Entry> entries_;  // most recently used first
  std::map<std::string, std::list<Entry>::iterator> index_;
};

}  // namespace loopwarden::page::history
