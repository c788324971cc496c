// SPDX-License-Identifier: Apache-2.0
// Creep: the last part of every move is late (effect `creep`).
//
//   x = u - z     z(k) = clamp( e^(-h/T) z(k-1) + u(k) - u(k-1), -A, A )
//
//   u, x  CO units     z  late part of the move, CO units     A  amount, CO units, >= 0: limit of z
//   T  time_constant, s, > 0     h  s
//
// A small move is late as a whole, as after a lag. Of a large move only A is late and the other
// part is immediate.
// Causes: elastomers and packings that relax, a positioner whose integral action ends the travel.
//
// Severity p fades it in as p A.
// Errors: no exceptions; if u is not finite, neither is x until the next reset.
// Limits: one time constant; real relaxation continues with the logarithm of time.
//
// Source: Findley, Lai and Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials (1976):
// standard linear solid, whose slow part is limited here.
#pragma once

#include <algorithm>
#include <cmath>

namespace loopwarden::effects {

class Creep {
 public:
  Creep(double amount, double time_constant_s, double period_s) noexcept
      : full_(amount), amount_(amount), keep_(std::exp(-period_s / time_constant_s)) {}

  void set_severity(double severity) noexcept { amount_ = full_ * severity; }
  double reset(double u) noexcept {
    late_ = 0.0;
    return last_ = u;
  }
  double step(double u) noexcept {
    const double due = keep_ * late_ + u - last_;
    late_ = std::clamp(due, -amount_, amount_);
    limited_ = late_ != due;
    last_ = u;
    return u - late_;
  }
  bool limited() const noexcept { return limited_; }  // part of the move was immediate

 private:
  double full_;    // CO units
  double amount_;  // CO units
  double keep_;
  double late_ = 0.0;  // CO units
  double last_ = 0.0;  // CO units
  bool limited_ = false;
};

}  // namespace loopwarden::effects
