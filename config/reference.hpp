// SPDX-License-Identifier: Apache-2.0
// What stands around the keys in docs/configuration.md and in loopwardend.yaml(5), as the files in reference/ have it
// (CMakeLists.txt puts them into the library).
#pragma once

namespace loopwarden::config {

extern const char* const kIntroduction;  // introduction.md
// From here on Markdown of headings, paragraphs, lists, code and `words`: manual_page() takes it over.
extern const char* const kRules;        // rules.md
extern const char* const kLoopNotes;    // loop_notes.md
extern const char* const kWiringNotes;  // wiring_notes.md
extern const char* const kManualHead;   // manual_head.scd
extern const char* const kManualTail;   // manual_tail.scd

}  // namespace loopwarden::config
