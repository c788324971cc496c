// SPDX-License-Identifier: Apache-2.0
// Runs the daemon's monitor over labelled records of real loops, without specialists, to find the
// alarms that routine evidence raises.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace loopwarden::lab {

// Replays the records in labels.csv of each folder, loop by loop, with a gap in automatic between
// records. Throws record::RecordError.
nlohmann::json replay_loops(const std::vector<std::string>& folders);
// Prints the result of replay_loops() as a table.
void print_loops(const nlohmann::json& loops);

}  // namespace loopwarden::lab
