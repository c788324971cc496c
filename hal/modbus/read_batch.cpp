// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/read_batch.hpp"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <tuple>

namespace loopwarden::hal::modbus {
namespace {

constexpr std::int64_t kEarlyPart = 10;  // of a period

const ReadShape& shape_of(const LinkTask& task) { return task.reads.front()->value_read; }
int end_of(const LinkTask& task) { return shape_of(task).address + shape_of(task).needed; }

bool can_be_merged(const LinkTask& task) {
  return task.yields && !task.command && task.reads.size() == 1 &&
         can_be_merged(task.reads.front()->settings);
}

bool alike(const LinkTask& a, const LinkTask& b) {
  return can_be_merged(b) && shape_of(a).unit == shape_of(b).unit &&
         shape_of(a).function == shape_of(b).function && a.period_ns == b.period_ns;
}

}  // namespace

void gather(LinkTask& first, std::span<LinkTask* const> tasks, std::int64_t now_ns,
            int most_registers, std::vector<LinkTask*>& batch) {
  batch.assign(1, &first);
  if (!can_be_merged(first) || first.apart || first.alone) return;
  std::vector<LinkTask*> row;
  std::copy_if(tasks.begin(), tasks.end(), std::back_inserter(row),
               [&](const LinkTask* task) { return alike(first, *task); });
  std::stable_sort(row.begin(), row.end(), [](const LinkTask* a, const LinkTask* b) {
    return std::tuple(shape_of(*a).address, end_of(*a)) <
           std::tuple(shape_of(*b).address, end_of(*b));
  });
  std::vector<MergedRead> reads;
  for (const LinkTask* task : row) {
    const bool by_itself = task->apart || task->alone;
    reads.push_back({shape_of(*task).address, end_of(*task), by_itself, task->cut_before});
  }
  auto starts = run_starts(reads, most_registers);
  starts.push_back(row.size());
  const auto at = static_cast<std::size_t>(std::find(row.begin(), row.end(), &first) - row.begin());
  const auto behind = std::upper_bound(starts.begin(), starts.end(), at);
  batch.clear();
  for (std::size_t i = *(behind - 1); i < *behind; ++i) {
    const bool due = row[i]->due_ns <= now_ns + row[i]->period_ns / kEarlyPart;
    if (i == at || due) batch.push_back(row[i]);
  }
}

ReadShape joint_shape(std::span<LinkTask* const> batch) noexcept {
  ReadShape shape = shape_of(*batch.front());
  int high = 0;
  for (const LinkTask* task : batch) high = std::max(high, end_of(*task));
  shape.needed = shape.count = static_cast<std::uint16_t>(high - shape.address);
  return shape;
}

std::size_t parting(std::span<LinkTask* const> batch) noexcept {
  const auto middle = static_cast<int>(batch.size() / 2);
  std::size_t best = batch.size() / 2;
  int widest = 0;
  int high = end_of(*batch.front());
  for (std::size_t i = 1; i < batch.size(); ++i) {
    const int gap = shape_of(*batch[i]).address - high;
    const auto off = [&](std::size_t k) { return std::abs(static_cast<int>(k) - middle); };
    if (gap > widest || (gap == widest && gap > 0 && off(i) < off(best))) {
      widest = gap;
      best = i;
    }
    high = std::max(high, end_of(*batch[i]));
  }
  return best;
}

}  // namespace loopwarden::hal::modbus
