// SPDX-License-Identifier: Apache-2.0
// One message to one channel, of one or many events.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "services/notify/rules/event.hpp"

namespace loopwarden::notify {

// Events beyond this number are only counted.
inline constexpr std::size_t kMostListed = 100;

// The trend around one of a message's events.
struct Picture {
  std::size_t event = 0;  // its place among them
  std::string png;
};

struct Message {
  std::int64_t id = 0;  // counts up, of this box
  std::string channel;
  std::int64_t made_ms = 0;
  std::vector<Event> events;             // at most kMostListed, oldest first
  std::array<std::int64_t, 5> counts{};  // of all of them, by Change
  std::int64_t lost = 0;                 // older events for which there was no room
  std::int64_t attempts = 0;             // so far
  bool perhaps_twice = false;            // the program ended while it was being sent
  bool test = false;
  std::vector<Picture> pictures{};  // drawn as it is sent, never stored

  std::int64_t count() const noexcept {
    std::int64_t sum = 0;
    for (const std::int64_t one : counts) sum += one;
    return sum;
  }
};

}  // namespace loopwarden::notify
