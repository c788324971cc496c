// SPDX-License-Identifier: Apache-2.0
// Which channels an event goes to, and which hear of it again while nobody acknowledges.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "services/notify/rules/changes.hpp"
#include "services/notify/rules/rule_settings.hpp"

namespace loopwarden::notify {

using ChannelNames = std::set<std::string>;

// How an alarm of the box gets to people: by routes that have the box, else by all that have the alarm, whatever their
// loops; to logs alone; or not at all.
enum class BoxWay : std::uint8_t { own, all, logs, none };
BoxWay box_way(const std::vector<Route>& routes, const std::string& alarm);

// Of a change. An alarm that was not severe enough for a route when it came is not told there when it goes.
ChannelNames channels_of(const std::vector<Route>& routes, const Event& event);

// Of an alarm that was there and is worse now: the channels of the routes for which only now it is severe enough.
ChannelNames newly_told(const std::vector<Route>& routes, const Event& event,
                        std::optional<double> worst_before);

// Repeats and escalation steps of an alarm that came at `since_ms`, that fall due after `from_ms` and not after `to_ms`.
// Several repeats of one step that fell due meanwhile are one.
ChannelNames reminded(const std::vector<Route>& routes, const Event& event, std::int64_t since_ms,
                      std::int64_t from_ms, std::int64_t to_ms);

}  // namespace loopwarden::notify
