// SPDX-License-Identifier: Apache-2.0
// Style and script of the gap report, both part of the page itself.
#pragma once

namespace loopwarden::workbench {

// Light and dark by the reader's setting, always light on paper. The colours of measured, before
// and after keep apart for all common kinds of colour blindness.
extern const char* const kReportStyle;

// One span of time for all plots: zoom, move, read off. It reads the values back from the paths, so
// that nothing stands in the file twice. Without it the pictures stand still.
extern const char* const kReportScript;

}  // namespace loopwarden::workbench
