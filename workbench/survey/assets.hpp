// SPDX-License-Identifier: Apache-2.0
// The style and the scripts of the survey's pages. CMakeLists.txt embeds their files in the
// program.
#pragma once

namespace loopwarden::workbench {

extern const char* const kSurveyStyle;       // survey.css
extern const char* const kSurveyScript;      // survey.js
extern const char* const kSurveyLoopScript;  // loop.js

}  // namespace loopwarden::workbench
