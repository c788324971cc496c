// SPDX-License-Identifier: Apache-2.0
// Draws a loop's trend around one moment for a message: PV and SP above, CO and the valve's travel
// below, local times, and a line at the moment. A pure function of its arguments.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "services/page/history/history.hpp"

namespace date {
class time_zone;
}

namespace loopwarden::notify {

inline constexpr int kPictureWidth = 600;  // px
inline constexpr int kPictureHeight = 400;

struct TrendPicture {
  std::string title;
  const date::time_zone* zone = nullptr;
  page::history::Stretch stretch;
  std::int64_t event_ms = 0;  // UTC
  std::string pv_unit;
  std::string co_unit;
  std::array<double, 2> pv_range{};  // of the loop; an axis never reaches far beyond
  std::array<double, 2> co_range{};
  page::history::Curves curves;
};

// Returns a PNG; empty if there is neither PV nor CO to draw, or memory runs out.
std::string png_of(const TrendPicture& picture);

}  // namespace loopwarden::notify
