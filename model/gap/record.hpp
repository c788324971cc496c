// SPDX-License-Identifier: Apache-2.0
// A measured record as the gap workflow takes it: plain columns on a constant period.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace loopwarden::gap {

// Columns of equal length; one that was not measured is empty, or missing throughout. NaN marks a
// missing sample. The stem is for pictures only: nothing is fitted to it.
struct Record {
  double period_s = 0.1;       // s, > 0
  std::vector<double> pv;      // PV units
  std::vector<double> sp;      // PV units
  std::vector<double> co;      // CO units, what went out to the positioner
  std::vector<double> stem{};  // CO units, the positioner's read-back
  // PV stands only where a value was stored; what is empty is no fault of the measurement.
  bool pv_as_stored = false;

  std::size_t size() const noexcept { return pv.size(); }
  bool has_sp() const noexcept { return has_value(sp); }
  bool has_co() const noexcept { return has_value(co); }
  double time_s(std::size_t k) const noexcept { return static_cast<double>(k) * period_s; }

  static bool has_value(const std::vector<double>& column) noexcept {
    return std::any_of(column.begin(), column.end(), [](double v) { return std::isfinite(v); });
  }
};

struct SampleRange {
  std::size_t begin = 0, end = 0;
};

// The first two thirds choose and fit; the rest, the holdout, only proves.
inline std::size_t training_samples(std::size_t samples) noexcept { return samples * 2 / 3; }

}  // namespace loopwarden::gap
