// SPDX-License-Identifier: Apache-2.0
#include "services/notify/rules/dispatch.hpp"

#include <algorithm>
#include <limits>

namespace loopwarden::notify {
namespace {

constexpr std::int64_t kHour = 3'600'000;  // ms

// Returns how many messages may be made now. Times in the future (clock set back) don't count.
std::size_t messages_left(const ChannelRule& channel, std::span<const std::int64_t> made_ms,
                          std::int64_t now_ms) {
  if (channel.most_per_hour == 0) return std::numeric_limits<std::size_t>::max();
  const auto used = std::count_if(made_ms.begin(), made_ms.end(), [&](std::int64_t at_ms) {
    return at_ms <= now_ms && now_ms - at_ms < kHour;
  });
  return static_cast<std::size_t>(std::max<std::int64_t>(channel.most_per_hour - used, 0));
}

// Also true if the clock was set back so far that the event would wait for longer than it may.
bool group_is_full(const ChannelRule& channel, const Waiting& oldest, std::int64_t now_ms) {
  return now_ms - oldest.since_ms >= channel.group_ms || now_ms < oldest.since_ms;
}

bool waits_for_digest(const ChannelRule& channel, const Waiting& one, std::int64_t now_ms) {
  if (!channel.digest_min || one.event.priority != "low" || now_ms < one.since_ms) return false;
  return one.since_ms > newest_time_of_day(*channel.zone, *channel.digest_min, now_ms);
}

}  // namespace

std::vector<std::size_t> ready(const ChannelRule& channel, const std::vector<QuietHours>& quiet,
                               std::span<const Waiting> waiting,
                               std::span<const std::int64_t> made_ms, std::int64_t now_ms) {
  const std::size_t left = messages_left(channel, made_ms, now_ms);
  if (left == 0) return {};
  const std::vector<const QuietHours*> on = quiet_now(quiet, channel.name, now_ms);
  std::vector<std::size_t> free;
  for (std::size_t i = 0; i < waiting.size(); ++i) {
    if (!held(on, waiting[i].event) && !waits_for_digest(channel, waiting[i], now_ms)) {
      free.push_back(i);
    }
  }
  if (free.empty() || !group_is_full(channel, waiting[free.front()], now_ms)) return {};
  if (channel.one_each && free.size() > left) free.resize(left);
  return free;
}

Message message_of(const std::string& channel, std::span<const Event> events, std::int64_t now_ms) {
  Message message;
  message.channel = channel;
  message.made_ms = now_ms;
  for (const Event& event : events) {
    ++message.counts.at(static_cast<std::size_t>(event.change));
    if (message.events.size() < kMostListed) message.events.push_back(event);
  }
  return message;
}

}  // namespace loopwarden::notify
