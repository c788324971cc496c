// SPDX-License-Identifier: Apache-2.0
// The styles and scripts of the pages. CMakeLists.txt embeds their files in the program.
#pragma once

namespace loopwarden::workbench {

extern const char* const kPageStyle;        // page.css
extern const char* const kGapReportStyle;   // gap_report.css
extern const char* const kGapReportScript;  // gap_report.js
extern const char* const kUplotStyle;       // services/page/third_party/uplot
extern const char* const kUplotScript;

}  // namespace loopwarden::workbench
