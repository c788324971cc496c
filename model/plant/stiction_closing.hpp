// SPDX-License-Identifier: Apache-2.0
// Stiction with another friction on closing than on opening (effect `stiction` with `s_closing`).
//
// The law of stiction_choudhury.hpp, each direction with friction of its own:
//
//   stuck:   x stays, until u - x > fs (opens, to x = u - fd) or x - u > fs' (closes, to x = u + fd')
//   moving:  as there, at the distance fd or fd'
//
//   u, x  CO units     fs = (s + j)/2, fd = (s - j)/2 of `s`, `j`; fs', fd' of `s_closing`, `j_closing`
//
// So s and j are those of a valve that has this friction both ways. After it closed, the stem opens when CO
// has come back by fs + fd', and closes after it opened by fs' + fd. Seen where packing or a guide binds one
// way, and where the fluid helps the stem one way and not the other.
//
// Severity p fades it in as p s, p j, p s' and p j'.
// Errors: no exceptions. If u is not finite, the stem keeps its position.
// Limits: what stiction_choudhury.hpp can't.
//
// Source: Choudhury, Thornhill and Shah, Control Engineering Practice 13 (2005) 641-658, for the law;
// Garcia, Control Engineering Practice 16 (2008) 667-681, on friction that depends on the direction.
#pragma once

#include <cmath>

#include "model/plant/stiction_choudhury.hpp"
#include "model/plant/stiction_law.hpp"

namespace loopwarden::plant {

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
    // The stem is behind u in the direction in which it moves or would start.
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

}  // namespace loopwarden::plant
