// SPDX-License-Identifier: Apache-2.0
// The gap workflow on a record of which an archive kept only a part (analysis/archive.hpp). Between
// stored values PV and CO are intervals, so that even a perfect model misses PV by
//
//   c = sqrt((d_PV^2 + (K d_CO)^2) / 3)        PV units
//
// d_PV, d_CO: deviations or dead bands; K: the model's gain, 0 where the process integrates; the
// third for errors that are equally likely anywhere in the interval. Then
//
//   floor = sqrt(noise floor^2 + c^2)             c counts as the transmitter's; a load is what is more than that
//
// and no more is said than that allows:
//   the model as given misses PV by no more than 1.5 floors                              no gap
//   an effect counts if it brings 0.7 c of the misfit, and, where it has a band in CO units, if that is wider than
//   2 max(d_CO, d_PV / K); the search is made again without those that don't
//   clipped, held and quantised measurements are what an archive itself leaves           not named
//   nothing is left to name                                                              unexplained, by compression
//   what leaves 0.3 c more than the named effect at most, and has fewer parameters, is named instead of it, and that is its
//   alternative
//   of several effects one only is named: beside it the archive's own traces pass for another
//   no confidence above 0.85
// Where an archive was recognised but not what it keeps to, nothing is named but no gap.
// d_PV and d_CO are estimates within a factor of two; sizes found are those of a record that was
// drawn, and come with wider intervals than they say.
#pragma once

#include "model/gap/workflow.hpp"

namespace loopwarden::gap {

struct Deviations {
  double pv = 0.0;    // PV units
  double co = 0.0;    // CO units
  bool known = true;  // false: at least one of them is more, nobody knows how much
};

// CO units: what is narrower can't be seen.
double sees_from(const plant::LoopModel& model, const Deviations& deviations);

Result find_gap_archived(const LoopRecord& record, const plant::LoopModel& model,
                         const Options& options, const Deviations& deviations,
                         const ParallelFor& parallel, const std::function<void(double)>& progress);

}  // namespace loopwarden::gap
