// SPDX-License-Identifier: Apache-2.0
#include "services/net/http/event_hub.hpp"

#include <fmt/format.h>

namespace loopwarden::http {
namespace {

constexpr std::array<const char*, kEventKinds> kNames{"daemon", "describe", "alarms", "overview"};
constexpr auto kDescribe = static_cast<std::size_t>(EventKind::describe);

}  // namespace

void EventHub::publish(EventKind kind, std::string_view data) {
  const auto index = static_cast<std::size_t>(kind);
  Slot& slot = slots_[index];
  ++slot.version;
  slot.frame = std::make_shared<const std::string>(
      fmt::format("event: {}\ndata: {}\n\n", kNames[index], data));
}

std::vector<Frame> EventHub::news(Cursor& cursor) const {
  std::vector<Frame> frames;
  for (std::size_t i = 0; i < kEventKinds; ++i) {
    if (cursor.seen[i] == slots_[i].version) continue;
    cursor.seen[i] = slots_[i].version;
    frames.push_back(slots_[i].frame);
  }
  return frames;
}

EventHub::Cursor EventHub::newcomer() const {
  Cursor cursor;
  cursor.seen[kDescribe] = slots_[kDescribe].version;
  return cursor;
}

}  // namespace loopwarden::http
