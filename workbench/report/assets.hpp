// SPDX-License-Identifier: Apache-2.0
// Styles and scripts of the pages, as their files have them (CMakeLists.txt puts them into the program).
#pragma once

namespace loopwarden::workbench {

extern const char* const kPageStyle;        // page.css
extern const char* const kGapReportStyle;   // gap_report.css
extern const char* const kGapReportScript;  // gap_report.js
extern const char* const kUplotStyle;       // services/page/third_party/uplot
extern const char* const kUplotScript;

}  // namespace loopwarden::workbench
