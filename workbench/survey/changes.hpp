// SPDX-License-Identifier: Apache-2.0
// Two surveys of one plant side by side: which findings are new, worse, better, gone.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "record/import/tag_rules.hpp"

namespace loopwarden::workbench {

// What the plant says of a loop.
struct LoopWeight {
  std::string criticality{};
  double order = 1e9;  // by criticality: the least first
  std::optional<double> cost_per_hour{};
  std::size_t line = 0;
};
using LoopWeights = std::map<std::string, LoopWeight>;  // by tag

// Columns tag, criticality (1, 2, ...; A, B, ...; high, medium, low: the first is the highest) and cost_per_hour. Throws
// CommandError.
LoopWeights read_loop_weights(const std::filesystem::path& path);

// Without a pattern what stands before the tag's function letters (two to five capitals with a C that is not the first:
// 21-FIC-105 is in 21), else the loop's number without its last two digits (FIC2105 in 21), else what stands before the
// first dash or digit. With one what stands at its first wildcard. "-" where there is nothing of it.
std::string area_of(std::string_view tag, const std::optional<record::TagPattern>& pattern);

// A survey.json, or that of a folder. Throws CommandError where it is none.
nlohmann::json read_survey(const std::filesystem::path& path);

struct Comparing {
  std::optional<record::TagPattern> area{};
  LoopWeights weights{};
};

// `now` and `before` as survey.json has them:
// {"now": {"from", "to"}, "before": {"from", "to"}, "counts": {CHANGE: loops}, "areas": [{"area", "loops", "findings",
//  "cost_per_hour", CHANGE: loops}], "loops": [{"tag", "change", "area", "criticality", "cost_per_hour", "now", "before",
//  "grade", "since", "next", "found"}], "not_in_survey": [tags of the weights]}
// A finding is a valve effect, or another cause; a held back one is none. CHANGE: new; worse, better: its size (of another
// cause the rms of SP - PV) is kGrown times what it was, or less than 1 / kGrown of it; same; gone: healthy now; rejected:
// held back now; unknown: can't be told now, or is not in `now`. Loops stand by change, criticality, cost and rank.
nlohmann::json compare_surveys(const nlohmann::json& now, const nlohmann::json& before,
                               const Comparing& how);

struct Change {
  const char* key;
  const char* heading;
};
inline constexpr std::array kChanges{Change{"new", "New"},
                                     Change{"worse", "Worse"},
                                     Change{"better", "Better"},
                                     Change{"gone", "Gone"},
                                     Change{"rejected", "Rejected: nothing was found"},
                                     Change{"unknown", "Can't be told now"},
                                     Change{"same", "As before"}};

std::string changes_text(const nlohmann::json& changes);
// One page that needs no other file.
std::string changes_page(const nlohmann::json& changes);

}  // namespace loopwarden::workbench
