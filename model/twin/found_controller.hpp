// SPDX-License-Identifier: Apache-2.0
// The settings of the controller that a record shows, if they are not the model's.
#pragma once

#include <optional>

#include "model/gap/check.hpp"

namespace loopwarden::twin {

struct FoundController {
  gap::FoundEffect effect;  // controller_mismatch: kp, ki, with a sentence
  bool exact = false;       // they leave no error of CO that matters
  double before_rmse = gap::kNone, after_rmse = gap::kNone;  // CO units
};

std::optional<FoundController> other_controller(const gap::CheckedRecord& checked);
// The model with these settings.
void adopt(const FoundController& found, plant::LoopModel& model);

}  // namespace loopwarden::twin
