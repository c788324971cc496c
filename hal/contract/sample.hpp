// SPDX-License-Identifier: Apache-2.0
// A value from a backend: engineering units, time of measurement and quality.
#pragma once

#include <cstdint>

#include "base/quality.hpp"

namespace loopwarden::hal {

using base::Limit;
using base::Quality;
using base::Reason;

struct Sample {
  double value = 0.0;          // engineering units; meaningless while quality is bad
  std::int64_t time_ns = 0;    // CLOCK_MONOTONIC when the value was taken
  std::uint32_t sequence = 0;  // +1 for each fresh value
  Quality quality = Quality::bad;
  Reason reason = Reason::never_received;
  Limit limit = Limit::none;
};

}  // namespace loopwarden::hal
