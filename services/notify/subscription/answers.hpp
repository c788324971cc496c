// SPDX-License-Identifier: Apache-2.0
// What the daemon answers on its status socket, as the rules want it. Names and reasons become one line each.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "daemon/protocol/answers.hpp"
#include "services/notify/rules/changes.hpp"
#include "services/notify/rules/watch_rules.hpp"

namespace loopwarden::notify {

std::vector<AlarmReading> readings_of(const protocol::Alarms& all);
std::vector<JournalLine> lines_of(const protocol::Journal& journal);
struct LoopWords {
  std::string description;
  std::string area;
};
// What the loops are for and where, by their tags.
std::map<std::string, LoopWords> words_of(const protocol::Description& about);

// What a person is told beside the alarm itself.
struct AlarmWords {
  std::string why{};  // of this coming or its incident; empty: nothing explains it
  std::string action{};
  std::string time_to_act{};
};
// `reading`: the alarm that was asked about.
AlarmWords words_of(const protocol::Explained& told, const AlarmReading& reading);

}  // namespace loopwarden::notify
