// SPDX-License-Identifier: Apache-2.0
// All loops of a plant, or a share of them: read, judged, kept one file a loop, joined and written.
//
//   OUT/loops/TAG-HASH.json    result of a loop; a run that was broken off goes on with those that are missing
//   OUT/failed.json            what could not be read, with reasons
//   OUT/survey.json .csv .html, pages/, assets/
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/exit_code.hpp"
#include "record/import/importer.hpp"
#include "workbench/command_line/share.hpp"
#include "workbench/survey/loop_result.hpp"

namespace loopwarden::workbench {

struct SurveyRun {
  std::vector<std::string> paths;
  std::filesystem::path out;
  record::ImportOptions import;
  SurveySettings settings;
  unsigned jobs = 1;
  Share share{};  // by the tag alone, so that a loop stays in its share when others come and go
};

struct SurveyCount {
  std::size_t loops = 0;    // of this share
  std::size_t judged = 0;   // now
  std::size_t resumed = 0;  // from an earlier run
  // What has no result, each with file, loop, why, and what was lost by it: "file" all of it, "loop" a loop that could not
  // be read, "signals" a loop that can't be judged since it has no PV or no CO. ("part", a file of a loop that is judged
  // without it, stands with the loop.)
  nlohmann::json failed = nlohmann::json::array();
  std::size_t files = 0;       // that were looked at
  std::size_t files_lost = 0;  // of them, those that gave no loop
  std::size_t passed_over = 0;
  std::string said;                // passed over, words taken as bad values, hints: lines
  ExitCode exit_code = kExitData;  // where no loop was found
  std::string rules;               // rules_text()
};

// Judges what is not judged yet. Throws RecordError where a path can't be looked at, OutputError.
SurveyCount judge_all(const SurveyRun& run);
// Joins the loops of one or several folders that judge_all wrote, and returns what survey.json then has; throws
// CommandError where it can't. `outcomes`: what fitters found; empty: outcomes.csv in `out`, where there is one.
nlohmann::json write_survey(const std::vector<std::filesystem::path>& folders,
                            const std::filesystem::path& out,
                            const std::filesystem::path& outcomes = {});

}  // namespace loopwarden::workbench
