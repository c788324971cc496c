// SPDX-License-Identifier: Apache-2.0
// The colours of all pictures and pages. Readers with any common colour vision can distinguish the
// curves (Okabe and Ito 2008). Pictures have a white background. Pages follow the reader's light or
// dark setting and print light.
#pragma once

#include <array>
#include <cstddef>
#include <string>

namespace loopwarden::workbench {

namespace palette {

inline constexpr const char* kPaper = "#ffffff";
inline constexpr const char* kPanel = "#f6f7f8";
inline constexpr const char* kInk = "#1b1f24";
inline constexpr const char* kSoft = "#5b6570";   // text next to the curves
inline constexpr const char* kFrame = "#b8bec5";  // frame of the curves
inline constexpr const char* kGrid = "#e7eaee";
inline constexpr const char* kBlue = "#0072b2";
inline constexpr const char* kVermilion = "#d55e00";
inline constexpr const char* kGreen = "#009e73";
inline constexpr const char* kPurple = "#cc79a7";
inline constexpr const char* kOrange = "#e69f00";
inline constexpr const char* kSky = "#56b4e9";
inline constexpr const char* kBrown = "#7a5b00";
inline constexpr const char* kGrey = "#7a828c";

// Each kind of curve has the same colour everywhere.
inline constexpr const char* kMeasured = kInk;
inline constexpr const char* kSetPoint = kGrey;
inline constexpr const char* kBefore = kVermilion;  // a model without the found effects
inline constexpr const char* kAfter = kBlue;        // a model with them

}  // namespace palette

// Returns a colour for adjacent lines that are of no kind listed above.
constexpr const char* chart_colour(std::size_t index) {
  constexpr std::array kColours{palette::kBlue,   palette::kVermilion, palette::kGreen,
                                palette::kPurple, palette::kInk,       palette::kOrange,
                                palette::kSky,    palette::kBrown};
  return kColours[index % kColours.size()];
}

// Returns the palette as CSS custom properties (--ink, --before, ...).
std::string palette_style();

}  // namespace loopwarden::workbench
