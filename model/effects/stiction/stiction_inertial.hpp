// SPDX-License-Identifier: Apache-2.0
// Stiction of a stem with momentum (effect `stiction`, law `inertial`): a spring-opposed actuator
// with Karnopp friction and actuator dynamics, solved exactly.
//
//   stuck   (x' = 0 and |u - x| <= fs):  x stays
//   moving  (d = sign x'):               x'' = wn^2 (u - x - d fd) - 2 z wn x'
//
//   u   CO units, held over a period    x   CO units, stem     d   direction of motion, -1 or +1
//   fs  CO units    static friction, (s + j) / 2    fd  CO units   moving friction, (s - j) / 2
//   wn  rad/s       actuator's undamped natural frequency, > 0     z   damping ratio, > 0
//
// With little damping a slip overshoots: the stem travels up to 2 j and stops there, while it
// travels j in the quasi-static laws. From z = 1 on it creeps to the position to which it jumps in
// those laws. At s = 0 this is the second-order actuator of positioner_overshoot.hpp.
//
// At an end of the travel the stem stops, x' = 0, and stays until the end of the period; friction
// also acts at the ends. The ends are checked once per period.
//
// While the stem moves, the equation is linear and has a closed solution. A stop within the period
// is computed from it, and the motion after the stop starts there.
// Severity p fades it in as p S and p J; at 0 the stem follows u immediately.
//
// Errors: no exceptions. If u is not finite, the stem keeps its position.
// Limits: no Stribeck curve and no presliding (LuGre); the same friction along the whole travel.
// Within a period u is constant, so a stem with a fast actuator stops after every step of u.
//
// Sources: Karnopp, J. Dyn. Sys., Meas., Control 107 (1985) 100-103; overshooting slip: He and
// Wang, Ind. Eng. Chem. Res. 53 (2014), the semi-physical model.
#pragma once

#include <cmath>

#include "model/effects/stiction/stiction_law.hpp"
#include "model/effects/travel.hpp"

namespace loopwarden::effects {

class StictionInertial {
 public:
  struct Actuator {
    double natural_frequency_rad_s = 20.0;  // rad/s
    double damping = 0.7;
  };
  // `period_s` > 0, shorter than half a natural period.
  StictionInertial(StictionParameters parameters, Actuator actuator, double period_s,
                   Travel travel = {}) noexcept;

  void set_severity(double severity) noexcept;
  double reset(double u) noexcept;
  double step(double u) noexcept {
    if (v_ == 0.0 && std::abs(u - x_) <= static_friction_ && !absent_) return x_;
    if (v_ != 0.0) {
      // The stem moves during the whole period, which is the usual case.
      const double centre = u - std::copysign(moving_friction_, v_);
      const double y = x_ - centre;
      const double v = vx_ * y + vv_ * v_;
      if (v * v_ > 0.0 && std::isfinite(u) && !absent_) {
        x_ = centre + xx_ * y + xv_ * v_;
        v_ = v;
        return travel_.beyond(x_) ? stop_at_end() : x_;
      }
    }
    start_or_stop(u);
    return travel_.beyond(x_) ? stop_at_end() : x_;
  }

  // Steps one period with `share` of the static friction, for a fit that takes the moments of the
  // slips from a record.
  double step_with_friction(double u, double share) noexcept {
    const double own = static_friction_;
    static_friction_ = share * own;
    const double x = step(u);
    static_friction_ = own;
    return x;
  }
  bool at_rest() const noexcept { return v_ == 0.0; }
  double position() const noexcept { return x_; }  // CO units

 private:
  // Steps a period in which the stem starts or stops.
  void start_or_stop(double u) noexcept;
  double stop_at_end() noexcept;
  struct Solution {
    double c, s;  // the solutions with the initial value 1 and slope 0, and value 0 and slope 1
  };
  Solution solution(double time_s) const noexcept;
  // Moves the stem for `time_s` about the end point `centre`; friction keeps its sign.
  void advance(double centre, double time_s) noexcept;

  StictionParameters full_;
  Travel travel_;
  double period_s_;
  double decay_rate_;  // z wn, 1/s
  bool overdamped_;    // z >= 1
  // of the damped swing, rad/s; overdamped: half the distance of the poles, 1/s
  double frequency_;
  double stiffness_;              // wn^2, 1/s^2
  double xx_, xv_, vx_, vv_;      // solution over one whole period
  double static_friction_ = 0.0;  // CO units
  double moving_friction_ = 0.0;  // CO units
  bool absent_ = false;
  double x_ = 0.0;  // CO units
  double v_ = 0.0;  // CO units/s
};

}  // namespace loopwarden::effects
