// SPDX-License-Identifier: Apache-2.0
// Writes the files for the answers, and checks whether the daemon would accept them.
#pragma once

#include <map>
#include <string>

#include "config/config_reader.hpp"
#include "workbench/setup/setup.hpp"

namespace loopwarden::workbench::setup {

using AnswerMap = std::map<std::string, std::string>;  // by question

struct PlannedFiles {
  std::string loop;  // text of the loop's file
  std::string link_name, link;
  // Settings of an existing link to the same device, if they differ from the answers.
  std::string other_settings;
  std::string daemon;  // text of loopwardend.yaml with the link; empty: the file has the link
};

// A key without an answer gets a value without risk, or is left out. Throws TestAborted if the link
// can't be added, CommandError if loopwardend.yaml has errors.
PlannedFiles planned_files(const Setup& setup, const AnswerMap& answers);

// Returns drafts that replace the files of the folder with those of the plan.
config::Drafts drafts_of(const Setup& setup, const PlannedFiles& planned);

// Returns why the daemon would refuse the files for this answer, given the answers to the earlier
// questions. Empty: the daemon would accept them.
std::string why_refused(const Setup& setup, const std::string& id, const std::string& answer);

// Returns the first kept answer that the earlier answers make invalid; empty: all are valid.
std::string refused_answer(const Setup& setup);

}  // namespace loopwarden::workbench::setup
