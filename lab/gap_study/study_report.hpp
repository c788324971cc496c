// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "lab/gap_study/score.hpp"

namespace loopwarden::studies::gap_study {

// One column of the table.
struct StudyPart {
  // "no load" or "load".
  std::string name;
  bool load = false;
  std::vector<ScoredCase> cases;
};

// Every figure with what is aimed at; shares with hits/of and their 95 % interval.
std::string table_text(const std::vector<StudyPart>& parts);

// Of the names given with so much confidence, how many are right.
std::string confidence_text(const StudyPart& part);

// Truth -> answers, how often.
std::string confusion_text(const StudyPart& part);

// One line a case: truth -> answer (confidence), before/after/floor, what came next.
std::string list_text(const StudyPart& part);

std::string study_json(const std::vector<StudyPart>& parts);

}  // namespace loopwarden::studies::gap_study
