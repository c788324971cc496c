// SPDX-License-Identifier: Apache-2.0
// From answers to the text of the daemon's files.
#pragma once

#include <functional>
#include <optional>
#include <string>

namespace loopwarden::workbench::setup {

// What was answered to a question; empty: it was not asked.
using Answered = std::function<std::string(const char* id)>;

// `link`: its name in loopwardend.yaml. The text is as good as the answers: the reader of the files has the last word.
std::string loop_text(const Answered& answered, const std::string& link);
std::string link_text(const Answered& answered);  // {transport: ...}

// `text` of loopwardend.yaml with the link; nullopt where its links are not written one a line.
std::optional<std::string> with_link(const std::string& text, const std::string& name,
                                     const std::string& link);

}  // namespace loopwarden::workbench::setup
