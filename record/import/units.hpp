// SPDX-License-Identifier: Apache-2.0
// Finds units of measurement in cells ("12.51 °C") and after names ("PV.CV GPM").
#pragma once

#include <string_view>

namespace loopwarden::record {

// Returns whether `text` is a unit: %, m3/h, °C, inH2O, kg/cm², ...
bool is_unit(std::string_view text);

struct WithUnit {
  std::string_view text;  // the number or the name
  std::string_view unit;  // empty: no unit
};
// Splits "12.51 °C" and "45%" into number and unit. Without a known unit, `text` is all.
WithUnit split_cell(std::string_view cell);
// Splits "PV.CV GPM" and "GAIN.CV No EngUnits" at the blank. Brackets are ignored.
WithUnit split_name(std::string_view name);

}  // namespace loopwarden::record
