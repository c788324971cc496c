// SPDX-License-Identifier: Apache-2.0
// Stiction with different friction on opening and closing (effect `stiction` with `s_closing`).
//
// The law of stiction_choudhury.hpp, with separate friction for each direction:
//
//   stuck:   x stays until u - x > fs (opens, to x = u - fd)
//            or x - u > fs' (closes, to x = u + fd')
//   moving:  as in that law, at the distance fd or fd'
//
//   u, x  CO units     fs = (s + j)/2, fd = (s - j)/2 of `s`, `j`
//                      fs', fd' likewise of `s_closing`, `j_closing`
//
// So s and j are those of a valve with this friction in both directions. After closing, the stem
// opens when CO has returned by fs + fd'; after opening, it closes when CO has returned by fs' +
// fd.
// Causes: packing or a guide that binds in one direction, or fluid that helps the stem in one
// direction only.
//
// Severity p fades it in as p s, p j, p s' and p j'.
// Errors: no exceptions. If u is not finite, the stem keeps its position.
// Limits: those of stiction_choudhury.hpp.
//
// Source: Choudhury, Thornhill and Shah, Control Engineering Practice 13 (2005) 641-658, for the
// law; Garcia, Control Engineering Practice 16 (2008) 667-681, on friction that depends on the
// direction.
#pragma once

#include <cmath>

#include "model/effects/stiction/stiction_choudhury.hpp"
#include "model/effects/stiction/stiction_law.hpp"

namespace loopwarden::effects {

class StictionClosing {
 public:
  StictionClosing(StictionParameters opening, StictionParameters closing) noexcept
      : full_opening_(opening), full_closing_(closing) {
    set_severity(1.0);
  }

  void set_severity(double severity) noexcept {
    opening_ = {full_opening_.s * severity, full_opening_.j * severity};
    closing_ = {full_closing_.s * severity, full_closing_.j * severity};
  }
  double reset(double u) noexcept {
    law_.last_u = u;
    law_.direction = 0.0;
    return law_.x = u;
  }
  double step(double u) noexcept {
    if (!std::isfinite(u)) return law_.x;
    // The stem lags u in the direction in which it moves or would start.
    const StictionParameters& now = u > law_.x ? opening_ : closing_;
    law_.static_friction = now.static_friction();
    law_.moving_friction = now.moving_friction();
    return law_.step(u);
  }

 private:
  StictionParameters full_opening_;
  StictionParameters full_closing_;
  StictionParameters opening_;
  StictionParameters closing_;
  ChoudhuryLaw<double> law_{};  // CO units
};

}  // namespace loopwarden::effects
