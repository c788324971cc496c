// SPDX-License-Identifier: Apache-2.0
// One cycle of one loop, as the real-time thread passes it to the recorder, which stores it on the
// disk.
#pragma once

#include <cstdint>
#include <type_traits>

#include "base/quality.hpp"
#include "model/control/loop_state.hpp"

namespace loopwarden::record {

// Bits of RecordRow::flags.
enum RecordFlag : std::uint8_t {
  kAtLow = 0x01,
  kAtHigh = 0x02,
  kRateLimited = 0x04,
  kLateCycle = 0x08,
  kJacketActs = 0x10,
  kOutputLost = 0x20,
  kCompensatorActs = 0x40,
  kOutOfService = 0x80,  // maintenance work on the loop
};

struct RecordRow {
  std::int64_t time_ns = 0;        // CLOCK_MONOTONIC at the start of the cycle
  std::uint64_t period_index = 0;  // periods since the daemon's start; a gap appears as a jump
  double sp = 0.0;                 // PV units
  double pv = 0.0;                 // PV units; NaN if missing
  double co = 0.0;                 // CO units, actual output; NaN: unknown
  double stem = 0.0;               // CO units, read-back; NaN if missing
  float calculated = 0.0F;         // CO units, the controller's result before limits; NaN as CO
  // Active correction, and requested correction (shadow) whether active or not.
  float jacket_rate = 0.0F;         // CO units/s, on the integral
  float jacket_rate_shadow = 0.0F;  // CO units/s
  float compensator = 0.0F;         // CO units, added to the output
  float compensator_shadow = 0.0F;  // CO units
  control::Mode mode = control::Mode::manual;
  control::Fault fault = control::Fault::none;
  base::Quality pv_quality = base::Quality::bad;
  base::Reason pv_reason = base::Reason::none;
  std::uint8_t flags = 0;  // RecordFlag
  control::JacketForm jacket_form = control::JacketForm::off;
  control::Mode requested_mode = control::Mode::manual;  // by the operator
  base::Limit pv_limit = base::Limit::none;              // PV is at a limit of its transmitter
  float age_ms = 0.0F;                                   // age of PV at the start of the cycle, ms
};

static_assert(std::is_trivially_copyable_v<RecordRow>);
static_assert(sizeof(RecordRow) == 80, "the segment files store this layout");

}  // namespace loopwarden::record
