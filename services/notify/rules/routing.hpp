// SPDX-License-Identifier: Apache-2.0
// Selects the channels of an event, and the channels that are reminded while it is unacknowledged.
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

// How an alarm of the box reaches people: by routes that name the box (own), otherwise by all
// routes that have the alarm, whatever their loops (all), only through logs, or not at all.
enum class BoxWay : std::uint8_t { own, all, logs, none };
BoxWay box_way(const std::vector<Route>& routes, const std::string& alarm);

// Returns the channels of a change. A route reports a cleared alarm only if the alarm was severe
// enough for it when it was raised.
ChannelNames channels_of(const std::vector<Route>& routes, const Event& event);

// Returns the channels of the routes for which an active alarm has only now become severe enough.
ChannelNames newly_told(const std::vector<Route>& routes, const Event& event,
                        std::optional<double> worst_before);

// Returns the channels of repeats and escalation steps that fall due after `from_ms` and not after
// `to_ms`, for an alarm raised at `since_ms`. Several missed repeats of one step count as one.
ChannelNames reminded(const std::vector<Route>& routes, const Event& event, std::int64_t since_ms,
                      std::int64_t from_ms, std::int64_t to_ms);

}  // namespace loopwarden::notify
