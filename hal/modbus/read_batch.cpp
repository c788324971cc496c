// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/read_batch.hpp"

#include <algorithm>
#include <utility>

namespace loopwarden::hal::modbus {
namespace {

constexpr std::int64_t kEarlyPart = 10;  // of a period

bool can_be_merged(const LinkTask& task) {
  return task.yields && task.merges && !task.command && task.reads.size() == 1 &&
         !task.reads.front()->status_read && !reads_bits(task.reads.front()->value_read.function);
}

const ReadShape& shape_of(const LinkTask& task) { return task.reads.front()->value_read; }
int end_of(const LinkTask& task) { return shape_of(task).address + shape_of(task).needed; }

}  // namespace

ReadShape gather(LinkTask& first, std::span<LinkTask* const> tasks, std::int64_t now_ns,
                 std::vector<LinkTask*>& batch) {
  batch.assign(1, &first);
  if (!can_be_merged(first)) return {};
  const ReadShape& own = shape_of(first);
  std::vector<LinkTask*> candidates;
  for (LinkTask* task : tasks) {
    if (task == &first || !can_be_merged(*task)) continue;
    const ReadShape& shape = shape_of(*task);
    const bool same = shape.unit == own.unit && shape.function == own.function;
    if (same && task->due_ns <= now_ns + task->period_ns / kEarlyPart) candidates.push_back(task);
  }
  std::sort(candidates.begin(), candidates.end(), [](const LinkTask* a, const LinkTask* b) {
    return std::pair(shape_of(*a).address, end_of(*a)) <
           std::pair(shape_of(*b).address, end_of(*b));
  });
  int low = own.address;
  int high = end_of(first);
  const auto take = [&](LinkTask* task) {
    const int lower = std::min<int>(low, shape_of(*task).address);
    const int higher = std::max(high, end_of(*task));
    const bool near = shape_of(*task).address - high <= kMostGap && low - end_of(*task) <= kMostGap;
    if (!near || higher - lower > static_cast<int>(kMaxReadRegisters)) return;
    low = lower;
    high = higher;
    batch.push_back(task);
  };
  const auto above = std::find_if(candidates.begin(), candidates.end(), [&](const LinkTask* task) {
    return shape_of(*task).address >= own.address;
  });
  std::for_each(above, candidates.end(), take);
  std::for_each(std::make_reverse_iterator(above), candidates.rend(), take);
  const auto count = static_cast<std::uint16_t>(high - low);
  return {own.unit, own.function, static_cast<std::uint16_t>(low), count, count};
}

}  // namespace loopwarden::hal::modbus
