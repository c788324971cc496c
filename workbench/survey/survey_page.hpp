// SPDX-License-Identifier: Apache-2.0
// Writes survey.html, the list with the worst loop first, and one page per loop. The pages need no
// network.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "workbench/files/output_files.hpp"

namespace loopwarden::workbench {

// Returns "stiction 4.1 %", "tuning", "can't tell", ...
std::string surveyed_verdict(const nlohmann::json& loop);
// Returns a period with a suitable unit: "60 s", "10 min", "2 h".
std::string period_text(double s);
// Returns true for an entry of `failed` that is a loop without PV or CO.
bool is_skipped(const nlohmann::json& problem);
// Returns a tag in which a line can break only after the characters that separate its parts.
std::string tag_html(const std::string& tag);

// `survey`: the result of join_survey, with the pictures of the loops.
void write_survey_pages(const nlohmann::json& survey, const std::filesystem::path& out,
                        OutputFiles& files);

}  // namespace loopwarden::workbench
