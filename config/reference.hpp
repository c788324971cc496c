// SPDX-License-Identifier: Apache-2.0
// The texts around the keys in docs/reference/configuration.md, from the files in reference/
// (CMakeLists.txt puts them into the library). They are Markdown with headings, paragraphs, lists,
// code and `words` only, so that docs/man/configuration.awk can convert it to loopwardend.yaml(5).
#pragma once

namespace loopwarden::config {

extern const char* const kIntroduction;  // introduction.md
extern const char* const kLoopNotes;     // loop_notes.md
extern const char* const kWiringNotes;   // wiring_notes.md

}  // namespace loopwarden::config
