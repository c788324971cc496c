// SPDX-License-Identifier: Apache-2.0
// The loops as the site names them: the tag that lists show, the area and the master loop. The
// site's rules decide (workbench/records/rules_file.hpp), otherwise the tag itself.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "record/import/tag_rules.hpp"

namespace loopwarden::workbench {

// Returns the tag without server, folders and block: PIC1112 of [default]Plant/Area1/PIC1112 and of
// PIC1112/PID1. A tag without an instrument's name (letters, then a number) is unchanged.
std::string_view instrument_part(std::string_view tag);

// Adds to each loop of survey.json:
//   "shown"  unique tag for lists; loops with equal texts keep their whole tags
//   "area"   path, such as "Plant/Area1", or null
//   "area_from"  "rule", "folder", "tag" or null; null also for an area that is only a guess
//   "master" tag of the master loop, or null
void name_loops(std::vector<nlohmann::json>& loops, std::span<const record::TagText> rules,
                const std::optional<record::TagPattern>& area);

// Returns whether something says that two loops share a unit: areas of one source of which one
// contains the other. Without such areas: one file, or records of which at least half is of one
// time.
bool share_a_unit(const nlohmann::json& a, const nlohmann::json& b);

}  // namespace loopwarden::workbench
