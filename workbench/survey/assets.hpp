// SPDX-License-Identifier: Apache-2.0
// Style and scripts of the survey's pages, as their files have them (CMakeLists.txt puts them into the program).
#pragma once

namespace loopwarden::workbench {

extern const char* const kSurveyStyle;       // survey.css
extern const char* const kSurveyScript;      // survey.js
extern const char* const kSurveyLoopScript;  // loop.js

}  // namespace loopwarden::workbench
