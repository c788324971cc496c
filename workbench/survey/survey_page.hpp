// SPDX-License-Identifier: Apache-2.0
// survey.html: the list, worst first, and a page a loop. Files beside each other, no network.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "workbench/files/output_files.hpp"

namespace loopwarden::workbench {

// "stiction 4.1 %", "tuning", "can't tell", ...
std::string surveyed_verdict(const nlohmann::json& loop);
// A tag that a line may break behind what sets its parts apart, and nowhere else.
std::string tag_html(const std::string& tag);

// `survey` as join_survey gives it, with the pictures of the loops.
void write_survey_pages(const nlohmann::json& survey, const std::filesystem::path& out,
                        OutputFiles& files);

}  // namespace loopwarden::workbench
