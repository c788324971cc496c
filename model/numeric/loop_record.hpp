// SPDX-License-Identifier: Apache-2.0
// The columns of one loop at a constant period. LoopRecord owns them, LoopView refers to them.
//
// All columns that are not empty have the length of PV. NaN marks a missing sample.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <span>
#include <vector>

namespace loopwarden::numeric {

// Returns the number of missing samples.
inline std::size_t missing(std::span<const double> column) noexcept {
  return static_cast<std::size_t>(
      std::count_if(column.begin(), column.end(), [](double v) { return !std::isfinite(v); }));
}

// Returns the samples that are not missing.
inline std::vector<double> known(std::span<const double> column) {
  std::vector<double> values;
  std::copy_if(column.begin(), column.end(), std::back_inserter(values),
               [](double v) { return std::isfinite(v); });
  return values;
}

struct LoopView {
  double period_s = 0.1;                // s, > 0
  std::span<const double> pv{};         // PV units
  std::span<const double> sp{};         // PV units
  std::span<const double> co{};         // CO units
  std::span<const double> stem{};       // CO units, read-back of the positioner
  std::span<const double> automatic{};  // 1: a controller moved CO, 0: it did not, NaN: unknown
  double pv_low = 0.0;                  // PV units, range of the transmitter
  double pv_high = 100.0;
  double co_low = 0.0;  // CO units, span of the controller's output
  double co_high = 100.0;

  std::size_t size() const noexcept { return pv.size(); }
  // Returns the samples from `from` to `to`, which is not included.
  LoopView part(std::size_t from, std::size_t to) const noexcept {
    LoopView out = *this;
    for (std::span<const double>* column : {&out.pv, &out.sp, &out.co, &out.stem, &out.automatic}) {
      if (!column->empty()) *column = column->subspan(from, to - from);
    }
    return out;
  }
};

struct LoopRecord {
  double period_s = 0.1;            // the members are those of LoopView
  std::vector<double> pv{};         // PV units
  std::vector<double> sp{};         // PV units
  std::vector<double> co{};         // CO units
  std::vector<double> stem{};       // CO units
  std::vector<double> automatic{};  // 1, 0, NaN
  bool pv_as_stored = false;        // PV is missing wherever an archive stored no value

  std::size_t size() const noexcept { return pv.size(); }
  double seconds_at(std::size_t k) const noexcept { return static_cast<double>(k) * period_s; }
  bool has_sp() const noexcept { return has_value(sp); }
  bool has_co() const noexcept { return has_value(co); }

  static bool has_value(std::span<const double> column) noexcept {
    return missing(column) < column.size();
  }

  LoopView view() const noexcept {
    return {
        .period_s = period_s, .pv = pv, .sp = sp, .co = co, .stem = stem, .automatic = automatic};
  }
  // Returns the samples from `from` to `to`, which is not included.
  LoopRecord part(std::size_t from, std::size_t to) const {
    const auto cut = [&](const std::vector<double>& column) {
      return column.empty()
                 ? column
                 : std::vector<double>(column.begin() + static_cast<std::ptrdiff_t>(from),
                                       column.begin() + static_cast<std::ptrdiff_t>(to));
    };
    return {period_s, cut(pv), cut(sp), cut(co), cut(stem), cut(automatic), pv_as_stored};
  }
};

}  // namespace loopwarden::numeric
