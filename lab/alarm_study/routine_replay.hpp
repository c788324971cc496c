// SPDX-License-Identifier: Apache-2.0
// The daemon's monitor over labelled records of real loops, without specialists: which alarms routine evidence raises.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace loopwarden::studies {

// Of each folder's labels.csv the records of a loop one after the other, with a minute in automatic between them.
// Throws record::RecordError.
nlohmann::json replay_loops(const std::vector<std::string>& folders);
// What replay_loops() found, as a table.
void print_loops(const nlohmann::json& loops);

}  // namespace loopwarden::studies
