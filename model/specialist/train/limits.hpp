// SPDX-License-Identifier: Apache-2.0
// Constants that decide the training of the specialists. The distributions of the simulated windows
// stand next to their draws (simulated_windows.cpp).
// Source: chosen by hand, unless a line names another. `loopwarden-study specialist` measures the
// trained specialists; no study measures these one by one.
#pragma once

#include <cstddef>

namespace loopwarden::specialist {

struct TrainLimits {
  static constexpr double kWorthwhile = 0.05;  // of the validation error, next size
  static constexpr std::size_t kSignaturesOfCondition = 25;
  static constexpr std::size_t kBatch = 64;       // windows
  static constexpr double kStep = 2e-3;           // falls to a tenth at the last epoch
  static constexpr double kDecay = 1e-4;          // of the weights, per step
  static constexpr double kFirstMoment = 0.9;     // of Adam (Kingma and Ba 2015)
  static constexpr double kSecondMoment = 0.999;  // the same
  static constexpr int kMostTries = 20;           // draws of a window
  static constexpr double kFirstMu = 1e-3;        // damping (Levenberg and Marquardt)
  static constexpr double kLargestMu = 1e10;      // then training ends
};

}  // namespace loopwarden::specialist
