// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "lab/gap_study/score.hpp"

namespace loopwarden::lab::gap_study {

// One column of the table.
struct StudyPart {
  // "no load" or "load".
  std::string name;
  bool load = false;
  std::vector<ScoredCase> cases;
};

// Returns all figures with their target values. Shares have hits/of and their 95 % interval.
std::string table_text(const std::vector<StudyPart>& parts);

// Returns the share of correct names by stated confidence.
std::string confidence_text(const StudyPart& part);

// Returns the number of cases by truth and answer.
std::string confusion_text(const StudyPart& part);

// Returns one line per case: truth -> answer (confidence), before/after/floor, the next candidates.
std::string list_text(const StudyPart& part);

std::string study_json(const std::vector<StudyPart>& parts);

}  // namespace loopwarden::lab::gap_study
