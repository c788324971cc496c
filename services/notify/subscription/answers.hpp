// SPDX-License-Identifier: Apache-2.0
// Converts answers of the daemon's status socket for the rules. Names and reasons become one line.
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
// Returns purpose and place of the loops, by tag.
std::map<std::string, LoopWords> words_of(const protocol::Description& about);

// The texts that a person gets in addition to the alarm itself.
struct AlarmWords {
  std::string why{};  // explanation of this alarm or its incident; empty: not explained
  std::string consequence{};
  std::string action{};
  std::string time_to_act{};
};
// `reading`: the alarm for which the explanation was requested.
AlarmWords words_of(const protocol::Explained& told, const AlarmReading& reading);

}  // namespace loopwarden::notify
