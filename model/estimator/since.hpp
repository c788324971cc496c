// SPDX-License-Identifier: Apache-2.0
// The laws of a change: every effect of the catalogue acts from a moment on, which is one more
// searched parameter. Before it the loop is the model's.
//
//   in the path       severity 0 before the moment
//   solved parameter  its response begins at the moment: a bias is a step, a drift a ramp
//
// An effect with times of its own (ramp, intermittent stiction) has no other form here.
#pragma once

#include <vector>

#include "model/estimator/law.hpp"

namespace loopwarden::estimator {

// s of the record, both ends.
struct Moments {
  double earliest_s = 0.0;
  double latest_s = 0.0;
};

std::vector<Law> laws_since(const std::vector<Candidate>& catalogue, double duration_s,
                            Moments moments);

}  // namespace loopwarden::estimator
