// SPDX-License-Identifier: Apache-2.0
// The files that the answers make, and whether the daemon would take them.
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
  std::string daemon;  // text of loopwardend.yaml with the link; empty: it has the link
};

// What has no answer is as harmless as it can be, or left out. Throws TestAborted where the link
// can't be added, CommandError where loopwardend.yaml has errors.
PlannedFiles planned_files(const Setup& setup, const AnswerMap& answers);

// With the files of the plan in place of those of the folder.
config::Drafts drafts_of(const Setup& setup, const PlannedFiles& planned);

// Why the daemon would refuse the files for this answer, by the answers to the questions before it;
// empty: it would not.
std::string why_refused(const Setup& setup, const std::string& id, const std::string& answer);

// The first kept answer that is refused by those before it; empty: none is.
std::string refused_answer(const Setup& setup);

}  // namespace loopwarden::workbench::setup
