// SPDX-License-Identifier: Apache-2.0
// Surveys all loops of a plant, or a share of them: reads, judges, stores one file per loop, joins
// and reports.
//
//   OUT/loops/TAG-HASH.json    result of a loop; a resumed run judges only the missing loops
//   OUT/failed.json            files and loops that could not be read, with reasons
//   OUT/worklist.csv           orders, one per row
//   OUT/survey.json .csv .html, pages/, assets/
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/exit_code.hpp"
#include "record/import/importer.hpp"
#include "workbench/command_line/share.hpp"
#include "workbench/survey/join.hpp"
#include "workbench/survey/loop_result.hpp"
#include "workbench/survey/worklist.hpp"

namespace loopwarden::workbench {

struct SurveyRun {
  std::vector<std::string> paths;
  std::filesystem::path out;
  record::ImportOptions import;
  SurveySettings settings;
  unsigned jobs = 1;
  Share share{};  // by the tag only, so other loops don't change a loop's share
};

struct SurveyCount {
  std::size_t loops = 0;    // of this share
  std::size_t judged = 0;   // now
  std::size_t resumed = 0;  // from an earlier run
  // Entries without a result, each with file, loop, why, and the loss: "file" is the whole file,
  // "loop" a loop that could not be read, "signals" a loop without PV or CO. A "part" is a file of
  // a loop that is judged without it. It is listed with the loop.
  nlohmann::json failed = nlohmann::json::array();
  std::size_t files = 0;       // read or tried
  std::size_t files_lost = 0;  // of them, files that yielded no loop
  std::size_t passed_over = 0;
  std::string said;                // skipped names, words read as bad values, hints: lines
  ExitCode exit_code = kExitData;  // if no loop was found
  std::string rules;               // rules_text()
};

// Judges the loops without a result. Throws RecordError if a path is not readable, OutputError.
SurveyCount judge_all(const SurveyRun& run);
// Joins the loops of one or several folders that judge_all wrote. Returns the content of
// survey.json. Throws CommandError if they can't be joined.
struct SurveyReport {
  std::filesystem::path outcomes{};  // findings of fitters; empty: outcomes.csv in `out`, if any
  SiteSettings site{};
  Costs costs{};
  LoopWeights weights{};
};
nlohmann::json write_survey(const std::vector<std::filesystem::path>& folders,
                            const std::filesystem::path& out, const SurveyReport& how = {});

}  // namespace loopwarden::workbench
