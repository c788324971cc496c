// SPDX-License-Identifier: Apache-2.0
// Writes the text of the daemon's files from the answers.
#pragma once

#include <functional>
#include <optional>
#include <string>

namespace loopwarden::workbench::setup {

// Returns the answer to a question; empty: the question was not asked.
using Answered = std::function<std::string(const char* id)>;

// Returns the text of the loop's file. `link`: the name of its link in loopwardend.yaml. The text
// may still have errors, so the reader of the files must check it.
std::string loop_text(const Answered& answered, const std::string& link);
std::string link_text(const Answered& answered);  // {transport: ...}

// Returns `text` of loopwardend.yaml with the link added; nullopt if its links are not one per
// line.
std::optional<std::string> with_link(const std::string& text, const std::string& name,
                                     const std::string& link);

}  // namespace loopwarden::workbench::setup
