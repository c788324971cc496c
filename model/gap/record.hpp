// SPDX-License-Identifier: Apache-2.0
// The parts of a measured record. The stem is for pictures only: nothing is fitted to it.
#pragma once

#include <cstddef>

#include "model/numeric/loop_record.hpp"

namespace loopwarden::gap {

using numeric::LoopRecord;

struct SampleRange {
  std::size_t begin = 0, end = 0;
};

// The first two thirds choose and fit; the rest, the holdout, only proves.
inline std::size_t training_samples(std::size_t samples) noexcept { return samples * 2 / 3; }

}  // namespace loopwarden::gap
