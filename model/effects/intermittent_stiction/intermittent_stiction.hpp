// SPDX-License-Identifier: Apache-2.0
// Stiction in one stretch of the record (effect `intermittent_stiction`).
//
//   F <= t < E:  x by the law of stiction_choudhury.hpp, at rest at u at the time F
//   otherwise:   x = u
//
//   u, x  CO units     s, j  CO units, see stiction_law.hpp     F, E  from and to, s, F < E
//   t  s, time of the record
//
// Causes: packing that was tightened and runs in, a stem that binds while it is hot or cold,
// crystals that form and are washed away. Several stretches need several such effects in series.
//
// Severity p fades it in as p s and p j.
// Errors: no exceptions. If u is not finite, the stem keeps its position while it sticks.
// Limits: it begins and ends within one sample.
//
// Source: Choudhury, Thornhill and Shah, Control Engineering Practice 13 (2005) 641-658, for the
// law.
#pragma once

#include "model/effects/stiction/stiction_choudhury.hpp"

namespace loopwarden::effects {

class IntermittentStiction {
 public:
  IntermittentStiction(StictionParameters parameters, double from_s, double to_s) noexcept
      : stem_(parameters), from_s_(from_s), to_s_(to_s) {}

  void set_severity(double severity) noexcept { stem_.set_severity(severity); }
  double reset(double u) noexcept { return stem_.reset(u); }
  double step(double u, double time_s) noexcept {
    return time_s >= from_s_ && time_s < to_s_ ? stem_.step(u) : stem_.reset(u);
  }

 private:
  StictionChoudhury stem_;
  double from_s_;  // s
  double to_s_;    // s
};

}  // namespace loopwarden::effects
