// SPDX-License-Identifier: Apache-2.0
// Lengths of the reads of one link. A serial reply carries no number and does not say what it answers, so there no two
// reads of a unit have the same length: a few registers more than needed are asked for. On TCP each is as long as needed.
//
// What it can't do: find a length for more reads of one size than there are spare registers; these share one.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <tuple>

#include "hal/modbus/link_task.hpp"

namespace loopwarden::hal::modbus {

class ReplyLengths {
 public:
  explicit ReplyLengths(bool distinct) : distinct_(distinct) {}

  // `tasks`: all of the link but `task`, which comes to them.
  void choose(LinkTask& task, std::span<LinkTask* const> tasks);
  // The read that serves several tasks at once: the same, with its length, whenever the same is wanted. It stays where
  // it is until the next call.
  ReadShape& joint(const ReadShape& wanted, std::span<LinkTask* const> tasks);
  // Of a read that no other is as long as.
  std::uint16_t barrier(std::uint8_t unit, ReadFunction function,
                        std::span<LinkTask* const> tasks) const;

 private:
  bool taken(std::uint8_t unit, ReadFunction function, std::uint16_t count,
             std::span<LinkTask* const> tasks) const;

  const bool distinct_;
  std::map<std::tuple<std::uint8_t, ReadFunction, std::uint16_t, std::uint16_t>, ReadShape> joint_;
  bool outdated_ = false;  // batches may be others now
};

}  // namespace loopwarden::hal::modbus
