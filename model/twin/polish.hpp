// SPDX-License-Identifier: Apache-2.0
// The last of a twin's fit: all its numbers at once, and the friction of a healthy valve, by the
// prediction errors that remain beside a load that wanders.
//
//   r(k) = PV(k) - free run(k)
//   e(k) = r(k) - d(k),  d(k+1) = d(k) + max(K, 1/(k+2)) e(k)      PV units
//   least sum of e^2 over the first two thirds
//
//   moved    gain, time constants, dead time, within a factor of 2; rangeability of a characteristic, or exp of a
//            polynomial of fourth order in the travel times its table; K among kGains: 0 is a loop without a load
//   friction a play, or a stick with j = kSlip s, up to `most_friction`; a model that has one already gets no second one.
//            None where its interval holds 0: where the mean over parts of the record of what sum e^2 falls by is less than
//            kSureFriction of its standard deviations
//   taken    where sum e^2 falls by kLeastGain or more over what it was fitted to, and falls over the last third too
//
// Errors: none; a record or model that can't be used comes back as it was.
// What it can't do: find an effect of another form; that is the gap workflow's, before this.
//
// Sources: Ljung, System Identification (1999), ch. 7 (prediction errors); Hagglund, Control Eng.
// Practice 10 (2002) (dead bands of healthy valves).
#pragma once

#include "model/gap/record.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::twin {

struct Polished {
  plant::LoopModel model;
  bool changed = false;
  double friction_percent = 0.0;  // what was added, % of the CO span
  double load_intensity = 0.0;    // of the load beside it, PV units per root second
  double rms_error = 0.0;         // e over the last third, PV units
};

// `most_friction`: CO units; 0: none is looked for.
Polished polish(const plant::LoopModel& model, const numeric::LoopRecord& record,
                double most_friction);

// The same numbers over the whole record, once its last third has proved them: what the loop did
// there counts too.
plant::LoopModel refitted(const plant::LoopModel& model, const numeric::LoopRecord& record);

}  // namespace loopwarden::twin
