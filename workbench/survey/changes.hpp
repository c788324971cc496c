// SPDX-License-Identifier: Apache-2.0
// Compares two surveys of one plant: which findings are new, worse, better or gone.
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

// The plant's own weight of a loop.
struct LoopWeight {
  std::string criticality{};
  double order = 1e9;  // rank by criticality; the smallest is first
  std::optional<double> cost_per_hour{};
  std::size_t line = 0;
};
using LoopWeights = std::map<std::string, LoopWeight>;  // by tag

// Reads the columns tag, criticality and cost_per_hour. Criticality is 1, 2, ...; A, B, ...; or
// high, medium, low; the first is the highest. Throws CommandError.
LoopWeights read_loop_weights(const std::filesystem::path& path);

// Returns the area of a tag, or "-" if it has no area. With a pattern, the area is the text at its
// first wildcard. Without a pattern, the area is the first of these that exists:
// - the text before the tag's function letters, which are two to five capitals with a C that is not
//   the first (21-FIC-105 is in 21)
// - the loop's number without its last two digits (FIC2105 is in 21)
// - the text before the first dash or digit
std::string area_of(std::string_view tag, const std::optional<record::TagPattern>& pattern);

// Reads a survey.json, or that of a folder. Throws CommandError if it is not a survey.
nlohmann::json read_survey(const std::filesystem::path& path);

struct Comparing {
  std::optional<record::TagPattern> area{};
  LoopWeights weights{};
};

// Compares `now` and `before`, both in the form of survey.json. Returns:
// {"now": {"from", "to"}, "before": {"from", "to"}, "counts": {CHANGE: loops},
//  "areas": [{"area", "loops", "findings", "cost_per_hour", CHANGE: loops}],
//  "loops": [{"tag", "change", "area", "criticality", "cost_per_hour", "now", "before", "grade",
//  "since", "next", "found"}], "not_in_survey": [tags of the weights]}
// A finding is a valve effect or another cause. A finding that is suppressed does not count. CHANGE
// is one of:
// - new
// - worse, better: the size is kGrown times the earlier size, or less than 1 / kGrown of it. The
//   size of another cause is the rms of SP - PV.
// - same
// - gone: healthy now
// - rejected: suppressed now
// - unknown: not decidable now, or not in `now`
// Loops are sorted by change, criticality, cost and rank.
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
                                     Change{"rejected", "Rejected: no fault was found"},
                                     Change{"unknown", "Undecided now"},
                                     Change{"same", "As before"}};

std::string changes_text(const nlohmann::json& changes);
// Returns a self-contained page.
std::string changes_page(const nlohmann::json& changes);

}  // namespace loopwarden::workbench
