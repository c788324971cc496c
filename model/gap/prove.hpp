// SPDX-License-Identifier: Apache-2.0
// The share of the gap that a model closes on the last third of the record, which no fit used.
//
//   gap closed = (before^2 - after^2)/(before^2 - floor^2), -1 to 1
//
//   before, after  rmse of the free run, of the given and of the corrected model, PV units
//   floor          Floor::rmse(), PV units
//
// From 80 % on a name is given as it is, from 50 % on with less confidence, and below 50 % not.
#pragma once

#include "model/gap/result.hpp"

namespace loopwarden::gap {

// NaN if `before_rmse` is below two floors.
double gap_closed(double before_rmse, double after_rmse, double floor_rmse) noexcept;

}  // namespace loopwarden::gap
