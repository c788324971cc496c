// SPDX-License-Identifier: Apache-2.0
// A record with another sample time than the model's, h. A controller holds CO between its samples:
//
//   record slower, every n h   the model is stepped at n h, CO held; where an archive stored CO by straight lines, with
//                              the mean of the line from one CO to the next
//   record faster, every h / n every n-th PV, with the mean of the n CO from there on
//
// Then the controller is not compared: its law has the model's h. Found sizes hold for that CO, and
// no confidence is above 0.85. Where PV stands only as it was stored, every sample of the record is
// stepped, whatever its period. Ranges: n from 2 to 20, within 1 %. Errors: none; nothing where the
// periods agree or no n fits.
#pragma once

#include <optional>

#include "model/gap/workflow.hpp"

namespace loopwarden::gap {

struct OnePeriod {
  LoopRecord record;
  plant::LoopModel model;
};

std::optional<OnePeriod> on_one_period(const LoopRecord& record, const plant::LoopModel& model,
                                       bool co_in_lines);
// What must be said of a result that came from it; `given` is the model as it was.
void say_other_period(Result& result, const plant::LoopModel& given, double record_period_s);

}  // namespace loopwarden::gap
