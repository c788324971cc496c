// SPDX-License-Identifier: Apache-2.0
// The dwelling of a sticking valve in the plane of CO and the quantity after the valve: it rests
// while CO moves on, then jumps. `behind` is this quantity: PV on a self-regulating process, the
// slope of PV on an integrating one. Equations and sources: docs/math/valve-evidence.md.
//
// Limits: load changes as large as the valve's steps hide the dwelling.
#pragma once

#include <cstddef>
#include <span>

namespace loopwarden::diagnosis {

struct DwellAsymmetry {
  std::size_t runs = 0;
  double output_concentration = 0.0;  // medians over the runs
  double behind_concentration = 0.0;
  double late = 0.5;
  double sticky_words = 0.0;
  double sticky_pairs = 0.0;
  double heavy_tails = 0.0;       // kurtosis of the changes of `behind`, log2 over 3
  double output_tails = 0.0;      // the same of CO
  double travel_scatter = 0.0;    // of CO between its turns, quartile range over median, at most 3
  double duration_scatter = 0.0;  // of the time between the turns, the same
  double loop_area = 0.0;  // of the ellipse-like loop in the plane, per cycle, over 2 pi; signed
};

DwellAsymmetry find_dwell_asymmetry(std::span<const double> output, std::span<const double> behind,
                                    double period);

}  // namespace loopwarden::diagnosis
