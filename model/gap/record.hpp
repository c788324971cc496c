// SPDX-License-Identifier: Apache-2.0
// A measured record as the gap workflow takes it: plain columns on a constant period.
#pragma once

#include <cstddef>
#include <vector>

namespace loopwarden::gap {

// Columns of equal length; one that was not measured is empty. NaN marks a missing sample.
struct Record {
  double period_s = 0.1;   // s, > 0
  std::vector<double> pv;  // PV units
  std::vector<double> sp;  // PV units
  std::vector<double> co;  // CO units, what went out to the positioner

  std::size_t size() const noexcept { return pv.size(); }
  bool has_sp() const noexcept { return !sp.empty(); }
  bool has_co() const noexcept { return !co.empty(); }
  double time_s(std::size_t k) const noexcept { return static_cast<double>(k) * period_s; }
};

// The first two thirds choose and fit; the rest, the holdout, only proves.
inline std::size_t training_samples(std::size_t samples) noexcept { return samples * 2 / 3; }

}  // namespace loopwarden::gap
