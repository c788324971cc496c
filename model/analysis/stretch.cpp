// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/stretch.hpp"

#include <algorithm>
#include <cmath>

#include "model/analysis/limits.hpp"

namespace loopwarden::analysis {
namespace {

constexpr std::size_t kStepsALength = 4;  // starts per length of a stretch

// The means of a block of samples and its shares of complete and automatic samples.
struct Block {
  double output = 0.0;
  double set_point = 0.0;
  double complete = 0.0;   // 0 to 1
  double automatic = 1.0;  // 0 to 1
};

std::vector<Block> blocks_of(const numeric::LoopView& r) {
  const std::span<const double> output = r.co.empty() ? r.pv : r.co;
  std::vector<Block> blocks(r.pv.size() / Limits::kStretchBlock);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    Block& block = blocks[b];
    double known = 0.0;
    double by_hand = 0.0;
    double set_points = 0.0;
    for (std::size_t k = b * Limits::kStretchBlock; k < (b + 1) * Limits::kStretchBlock; ++k) {
      if (!r.automatic.empty() && r.automatic[k] == 0.0) by_hand += 1.0;
      if (!r.sp.empty() && std::isfinite(r.sp[k])) {
        block.set_point += r.sp[k];
        set_points += 1.0;
      }
      if (!std::isfinite(r.pv[k]) || !std::isfinite(output[k])) continue;
      block.output += output[k];
      known += 1.0;
    }
    if (known > 0.0) block.output /= known;
    if (set_points > 0.0) block.set_point /= set_points;
    block.complete = known / static_cast<double>(Limits::kStretchBlock);
    block.automatic = 1.0 - by_hand / static_cast<double>(Limits::kStretchBlock);
  }
  return blocks;
}

struct Movement {
  double output = 0.0;  // standard deviations
  double set_point = 0.0;
  double complete = 0.0;
  double automatic = 0.0;
};

Movement movement(std::span<const Block> blocks) {
  Movement m;
  double n = 0.0;
  double output = 0.0;
  double set_point = 0.0;
  for (const Block& b : blocks) {
    m.complete += b.complete;
    m.automatic += b.automatic;
    if (b.complete <= 0.0) continue;
    n += 1.0;
    output += b.output;
    set_point += b.set_point;
  }
  if (n > 0.0) {
    for (const Block& b : blocks) {
      if (b.complete <= 0.0) continue;
      m.output += (b.output - output / n) * (b.output - output / n);
      m.set_point += (b.set_point - set_point / n) * (b.set_point - set_point / n);
    }
    m.output = std::sqrt(m.output / n);
    m.set_point = std::sqrt(m.set_point / n);
  }
  m.complete /= static_cast<double>(blocks.size());
  m.automatic /= static_cast<double>(blocks.size());
  return m;
}

}  // namespace

std::vector<std::size_t> telling_stretches(const numeric::LoopView& record, std::size_t length,
                                           std::size_t parts) {
  const std::size_t n = record.pv.size();
  if (n <= length || parts == 0) return {0};
  const std::vector<Block> blocks = blocks_of(record);
  const std::size_t wide = std::max<std::size_t>(1, length / Limits::kStretchBlock);
  const std::size_t step = std::max<std::size_t>(1, wide / kStepsALength);
  const Movement whole = movement(blocks);
  std::vector<std::size_t> starts;
  for (std::size_t part = 0; part < parts; ++part) {
    const std::size_t from = blocks.size() * part / parts;
    const std::size_t to = blocks.size() * (part + 1) / parts;
    double best = 0.0;
    std::size_t best_start = 0;
    for (std::size_t start = from;
         start + wide <= std::max(to, from + wide) && start + wide <= blocks.size();
         start += step) {
      const Movement m = movement(std::span(blocks).subspan(start, wide));
      double moves = whole.output > 0.0 ? m.output / whole.output : 0.0;
      if (whole.set_point > 0.0) moves += m.set_point / whole.set_point;
      const double score = moves * m.complete * m.complete * m.automatic;
      if (score > best) {
        best = score;
        best_start = start;
      }
    }
    if (best > 0.0) starts.push_back(best_start * Limits::kStretchBlock);
  }
  if (starts.empty()) starts.push_back(0);
  return starts;
}

}  // namespace loopwarden::analysis
