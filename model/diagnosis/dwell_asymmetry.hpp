// SPDX-License-Identifier: Apache-2.0
// The dwelling of a sticking valve in the plane of CO and the quantity after the valve: it rests
// while CO moves on, then jumps. `behind` is this quantity: PV on a self-regulating process, the
// slope of PV on an integrating one.
//
// Runs are the stretches between turning points of CO. In each:
//   concentration   the largest change within a seventh of the run, over the range within the run:
//                   a straight line 0.14, half a sine 0.22, a step 1
//   late            position of the largest change in the run, 0 at its start to 1 at its end
//   scatter         a valve determines the travel of CO between its turns (its band), a load the
//                   time between them: the smaller scatter shows which
// Over all samples, with changes over a tenth of a period put into the words up, steady, down
// (above or below half of their standard deviation):
//   sticky words    share of the samples with CO moving at which `behind` is steady
//   sticky pairs    share in which a steady stretch is followed by a move in CO's direction
//                   (Y. Yamashita, Control Engineering Practice 14, 2006, and J. Process Control
//                   16, 2006)
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
