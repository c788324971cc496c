// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "workbench/training/specialist_training.hpp"

namespace loopwarden::workbench {

// Returns the performance plots of a training run as one self-contained page (thesis, figures 8.7
// to
// 8.14): errors of training, validation and test over the epochs on a logarithmic scale, and the
// best epoch.
std::string training_page(const TrainingResult& result);

}  // namespace loopwarden::workbench
