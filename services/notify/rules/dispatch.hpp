// SPDX-License-Identifier: Apache-2.0
// Decides when the waiting events of a channel become a message: after the grouping time, outside
// quiet hours, and within the channel's rate. Events that must wait join the next message, so a
// flood of alarms makes few messages.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "services/notify/rules/message.hpp"
#include "services/notify/rules/rule_settings.hpp"

namespace loopwarden::notify {

struct Waiting {
  std::int64_t id = 0;
  std::int64_t since_ms = 0;
  Event event;
};

// Returns the positions of the waiting events that are sent now, in their order. `made_ms`: when
// the channel's last messages were made.
std::vector<std::size_t> ready(const ChannelRule& channel, const std::vector<QuietHours>& quiet,
                               std::span<const Waiting> waiting,
                               std::span<const std::int64_t> made_ms, std::int64_t now_ms);

// Returns the message of these events.
Message message_of(const std::string& channel, std::span<const Event> events, std::int64_t now_ms);

}  // namespace loopwarden::notify
