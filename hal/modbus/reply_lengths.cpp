// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/reply_lengths.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace loopwarden::hal::modbus {
namespace {

constexpr std::uint16_t kBitsAByte = 8;

template <class Visit>
void for_each_shape(LinkTask& task, Visit visit) {
  if (task.command && task.command->watchdog_read) visit(*task.command->watchdog_read);
  for (const auto& point : task.reads) {
    visit(point->value_read);
    if (point->status_read) visit(*point->status_read);
  }
}

// Returns whether the replies to both have the same length.
bool same_length(const ReadShape& shape, std::uint8_t unit, ReadFunction function,
                 std::uint16_t count) noexcept {
  return shape.unit == unit && shape.function == function &&
         reply_bytes(function, shape.count) == reply_bytes(function, count);
}

std::uint16_t step_of(ReadFunction function) noexcept {
  return reads_bits(function) ? kBitsAByte : 1;
}

// Gives the shape the shortest free length, if there is one.
template <class Taken>
void lengthen(ReadShape& shape, Taken taken) {
  const int step = step_of(shape.function);
  int count = shape.needed;
  while (count <= static_cast<int>(kMaxReadRegisters) &&
         count <= shape.needed + step * kMostExtra && shape.address + count <= 0x10000) {
    shape.count = static_cast<std::uint16_t>(count);
    if (!taken(shape.count)) return;
    count += step;
  }
  shape.count = shape.needed;
}

}  // namespace

bool ReplyLengths::taken(std::uint8_t unit, ReadFunction function, std::uint16_t count,
                         std::span<LinkTask* const> tasks) const {
  bool found = std::any_of(joint_.begin(), joint_.end(), [&](const auto& entry) {
    return same_length(entry.second, unit, function, count);
  });
  for (LinkTask* task : tasks) {
    for_each_shape(
        *task, [&](const ReadShape& shape) { found |= same_length(shape, unit, function, count); });
  }
  return found;
}

void ReplyLengths::choose(LinkTask& task, std::span<LinkTask* const> tasks) {
  outdated_ = true;
  if (!distinct_) return;
  std::vector<ReadShape*> chosen;
  for_each_shape(task, [&](ReadShape& shape) {
    lengthen(shape, [&](std::uint16_t count) {
      return taken(shape.unit, shape.function, count, tasks) ||
             std::any_of(chosen.begin(), chosen.end(), [&](const ReadShape* other) {
               return same_length(*other, shape.unit, shape.function, count);
             });
    });
    chosen.push_back(&shape);
  });
}

ReadShape& ReplyLengths::joint(const ReadShape& wanted, std::span<LinkTask* const> tasks) {
  if (std::exchange(outdated_, false)) joint_.clear();
  const auto key = std::tuple(wanted.unit, wanted.function, wanted.address, wanted.needed);
  if (const auto known = joint_.find(key); known != joint_.end()) return known->second;
  ReadShape shape = wanted;
  if (distinct_) {
    lengthen(shape,
             [&](std::uint16_t count) { return taken(shape.unit, shape.function, count, tasks); });
  }
  return joint_.emplace(key, shape).first->second;
}

std::uint16_t ReplyLengths::barrier(std::uint8_t unit, ReadFunction function,
                                    std::span<LinkTask* const> tasks) const {
  const std::uint16_t step = step_of(function);
  std::uint16_t count = 1;
  while (taken(unit, function, count, tasks) &&
         count + step <= static_cast<int>(kMaxReadRegisters)) {
    count += step;
  }
  return count;
}

}  // namespace loopwarden::hal::modbus
