// SPDX-License-Identifier: Apache-2.0
// Chooses the lengths of the reads of one link. A serial reply does not identify its request. Two
// reads of a unit therefore never have the same length: a few additional registers are read. On TCP
// each read has its natural length.
//
// Limits: it can't find a length for more reads of one size than there are spare registers. The
// others share one length.
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

  // Chooses the length of `task`, which joins `tasks`, all other tasks of the link.
  void choose(LinkTask& task, std::span<LinkTask* const> tasks);
  // Returns the read that serves several tasks at once. The same request always has the same
  // length. The reference is valid until the next call.
  ReadShape& joint(const ReadShape& wanted, std::span<LinkTask* const> tasks);
  // Returns a length that no other read has.
  std::uint16_t barrier(std::uint8_t unit, ReadFunction function,
                        std::span<LinkTask* const> tasks) const;

 private:
  bool taken(std::uint8_t unit, ReadFunction function, std::uint16_t count,
             std::span<LinkTask* const> tasks) const;

  const bool distinct_;
  std::map<std::tuple<std::uint8_t, ReadFunction, std::uint16_t, std::uint16_t>, ReadShape> joint_;
  bool outdated_ = false;  // batches may have changed
};

}  // namespace loopwarden::hal::modbus
