// SPDX-License-Identifier: Apache-2.0
// survey.html: the list, worst first, and a page a loop. Files beside each other, no network.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "workbench/files/output_files.hpp"

namespace loopwarden::workbench {

// `survey` as join_survey gives it, with the pictures of the loops.
void write_survey_pages(const nlohmann::json& survey, const std::filesystem::path& out,
                        OutputFiles& files);

}  // namespace loopwarden::workbench
