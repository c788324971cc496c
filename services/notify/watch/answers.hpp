// SPDX-License-Identifier: Apache-2.0
// What the daemon answers on its status socket, as the rules want it. Names and reasons become one line each.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "protocol/answers.hpp"
#include "services/notify/rules/changes.hpp"
#include "services/notify/rules/watch_rules.hpp"

namespace loopwarden::notify {

std::vector<AlarmReading> readings_of(const protocol::Alarms& all);
std::vector<JournalLine> lines_of(const protocol::Journal& journal);
// What the loops are for, by their tags.
std::map<std::string, std::string> descriptions_of(const protocol::Description& about);

}  // namespace loopwarden::notify
