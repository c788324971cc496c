// SPDX-License-Identifier: Apache-2.0
// A logger that writes CO some samples before or behind PV: no effect of the loop, but one more or
// one less of dead time to whoever takes the record as it stands.
//
// Two witnesses must agree on the shift d, in samples. The controller: of
//   u(k) - u(k-1) = Kp (e(k-d) - e(k-d-1)) + Ki h e(k-d)
// by least squares for d = -3 to 3, the one that leaves least, less than kClear of what d = 0
// leaves and less than kLaw of the whole. The plant: under CO moved back by d the model's PV is
// nearer to the measured one in kAgreeing of ten parts of the record, by the changes over one time
// constant, in which a wandering load is small. A controller that computes for a sample has the
// first, and not the second: its CO really comes later.
//
// Ranges: SP, PV and CO measured, a PI law, 200 samples at least. Errors: none; 0 where it is not
// clear. What it can't do: a shift that is no whole sample, PV and SP against each other, a
// controller with a filter on PV.
#pragma once

#include "model/gap/record.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::gap {

// Samples by which CO stands too late; below 0: too early.
int logger_shift(const LoopRecord& record, const plant::LoopModel& model);

// The record with CO moved back by so much; at the ends its first or last value stands.
LoopRecord with_co_moved_back(LoopRecord record, int samples);

}  // namespace loopwarden::gap
