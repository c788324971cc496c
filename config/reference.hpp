// SPDX-License-Identifier: Apache-2.0
// What stands around the keys in docs/configuration.md, as the files in reference/ have it (CMakeLists.txt puts them
// into the library): Markdown of headings, paragraphs, lists, code and `words`, so that docs/man/configuration.awk can
// make loopwardend.yaml(5) of it.
#pragma once

namespace loopwarden::config {

extern const char* const kIntroduction;  // introduction.md
extern const char* const kLoopNotes;     // loop_notes.md
extern const char* const kWiringNotes;   // wiring_notes.md

}  // namespace loopwarden::config
