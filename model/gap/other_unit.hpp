// SPDX-License-Identifier: Apache-2.0
// A record in other units than its model: % for engineering units, a share or mA for %,
// thousandths, kelvin, ...
//
// Each unit is tried by converting the record. One is taken for the record's where both the
// controller's law,
//   sum (du - Kp de - Ki h e)^2 / sum du^2,
// and the misfit of the model's free run, as a share of PV, fall below three tenths of what they
// are as it stands. A gain that has changed moves the second alone, other settings of the
// controller the first alone. Without a set point nothing is known of the controller: then the
// misfit must fall below a tenth, and PV or CO must be out of the model's range as it stands, or CO
// within a hundredth of it. Of units that explain the record alike (100 times the PV is a hundredth
// of the CO) the one is taken in which PV and CO make most use of their ranges.
//
// What it can't do: units that are not in the list, SP in another unit than PV, thinned records
// (the law holds no more).
#pragma once

#include <optional>
#include <string>

#include "model/gap/record.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::gap {

// What in the record stands for the ends of the model's range.
struct SignalUnit {
  std::string name;  // empty: the model's own unit
  double low = 0.0;
  double high = 1.0;
};

struct OtherUnit {
  SignalUnit pv;
  SignalUnit co;
  double rmse_as_it_stands = 0.0;  // PV units of the model
  double rmse_converted = 0.0;
};

// Errors: effects::EffectError for a model that can't be stepped. Nothing where the record has no
// CO, or is in the model's units as far as can be seen.
std::optional<OtherUnit> other_unit(const LoopRecord& record, const plant::LoopModel& model);

// The record in the model's units, of which these values stand for the ends.
LoopRecord in_models_units(LoopRecord record, const plant::LoopModel& model, const SignalUnit& pv,
                           const SignalUnit& co);

}  // namespace loopwarden::gap
