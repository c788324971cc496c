// SPDX-License-Identifier: Apache-2.0
// The colours of every picture and page. Curves are told apart by people with any common colour vision (Okabe and Ito
// 2008). Pictures are on white paper; pages follow the reader's light or dark setting and print light.
#pragma once

#include <array>
#include <cstddef>
#include <string>

namespace loopwarden::workbench {

namespace palette {

inline constexpr const char* kPaper = "#ffffff";
inline constexpr const char* kPanel = "#f6f7f8";
inline constexpr const char* kInk = "#1b1f24";
inline constexpr const char* kSoft = "#5b6570";   // text beside the curves
inline constexpr const char* kFrame = "#b8bec5";  // around them
inline constexpr const char* kGrid = "#e7eaee";
inline constexpr const char* kBlue = "#0072b2";
inline constexpr const char* kVermilion = "#d55e00";
inline constexpr const char* kGreen = "#009e73";
inline constexpr const char* kPurple = "#cc79a7";
inline constexpr const char* kOrange = "#e69f00";
inline constexpr const char* kSky = "#56b4e9";
inline constexpr const char* kBrown = "#7a5b00";
inline constexpr const char* kGrey = "#7a828c";

// What a curve is has one colour everywhere.
inline constexpr const char* kMeasured = kInk;
inline constexpr const char* kSetPoint = kGrey;
inline constexpr const char* kBefore = kVermilion;  // a model without what was found
inline constexpr const char* kAfter = kBlue;        // with it

}  // namespace palette

// For lines side by side that are nothing of the above.
constexpr const char* chart_colour(std::size_t index) {
  constexpr std::array kColours{palette::kBlue,   palette::kVermilion, palette::kGreen,
                                palette::kPurple, palette::kInk,       palette::kOrange,
                                palette::kSky,    palette::kBrown};
  return kColours[index % kColours.size()];
}

// The palette as CSS custom properties (--ink, --before, ...), for the style of a page.
std::string palette_style();

}  // namespace loopwarden::workbench
