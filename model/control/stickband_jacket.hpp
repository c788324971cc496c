// SPDX-License-Identifier: Apache-2.0
// The stickband jacket: a compensator for valve stiction that acts only inside the integrator.
//
//   dI/dt = Ki e + w                 e  control error, PV units     Ki  CO units / (PV unit s)
//   d     = u - x                    u  what really went out one period ago, CO units
//                                    x  what left the valve then, CO units: the positioner's
//                                       read-back, or a stated model of the valve
//   z     dead zone, CO units, >= 0        Ks  gain, 1/s, >= 0 (0: no action); not used by `dwell`
//
// Forms:
//   paper    w = -Ks d                                                    literal
//   bounded  w = -clamp(Ks (d - clamp(d, -z, z)), -|Ki e| / 2, |Ki e| / 2)
//   dwell    w = -(1 - clamp(5 |e / e_s| - 2.5, 0.05, 1)) Ki e   while stuck and crossed, else 0
//            stuck    |x - x_r| <= z, |u - u_r| > z and |(u - u_r) - (x - x_r)| > z
//            crossed  e has had the sign opposite to e_s since the stem last moved
//            x_r, u_r  x and u when the stem last moved by more than z
//            e_s       the error one period before the stem last broke loose after being stuck
//
// Why `dwell`: a sticking valve jumps to and fro between two positions whose errors e1 and -e2 are
// process gain times slip jump apart, which no controller can change. An integrator waits at each
// for as long as it takes to cross the stick band, S / (Ki |e|), so that RMS e = sqrt(e1 e2). Where
// the jump has halved the error, the dwell form integrates at a twentieth of Ki e, so that the
// valve rests there up to twenty times longer: RMS e falls towards the smaller of the two, and the
// stem moves less. From 0.7 |e_s| up, and on the way to a new set point, it is plain PI.
//
// What they achieve over random loops is printed by `loopwarden-study calm`, see docs/compensators.md:
// `paper` parks nearly every sticky loop off the set point at Ks = 1 and multiplies RMS e;
// `bounded` makes it fall in half of them, by little, and slows set-point changes; `dwell` in more
// than four of five, by about a fifth in the median, with less than half of the stem travel. The
// more the load wanders compared with the slip jump, the less any of them helps.
//
// `paper` is for simulation and shadow only: any stuck valve with Ki e = Ks d is an equilibrium,
// and a healthy valve whose read-back is off by b settles at e = Ks b / Ki. With the others |w| is
// at most Ki |e| / 2 (bounded) or 0.95 Ki |e| (dwell), so that I always moves towards zero error.
// (With noise on e, `bounded` can still stand still, at a mean error of about half its standard
// deviation, because it slows one sign of e only.)
// A constant bias of the read-back does not reach `dwell`, which looks at changes only; beyond z it
// makes `bounded` integrate at half speed towards one side.
//
// z goes above the noise and resolution of the read-back and, for `bounded`, above its bias; at a
// third of the stick band or more the jacket loses its effect. With z below the noise `dwell` takes
// noise for movement and does nothing.
//
// bounded and dwell are off (w = 0) while x is not to be trusted, and stand back while the mean
// error exceeds `max_mean_error` (first-order mean over `mean_error_time_s`; back on below half).
//
// Errors: none; a non-finite x counts as not to be trusted, and a non-finite e gives w = 0.
// What it can't do: it removes no friction; where e1 = e2 nothing is gained, and the loop still
// cycles. A loop so fast that it turns round before PV has settled after a jump has no e1 and e2,
// and may get worse. The mean error of `dwell` is not zero: it rests where PI would only pass. A
// read-back that freezes with a good status looks like a stuck valve: errors below e_s are then
// integrated slowly until `max_mean_error` ends it. A read-back that comes later than PV answers
// gives a wrong e_s. Without a read-back it is as good as the valve model it is given.
//
// Sources: paper: Sewdass and Govender, IFAC Proceedings 47 (2014), eq. 3, after Glattfelder and
// Schaufelberger, Int. J. Control 44 (1986). bounded and dwell are this project's.
#pragma once

#include <cstdint>
#include <limits>

namespace loopwarden::control {

enum class JacketForm : std::uint8_t { off, paper, bounded, dwell };

struct JacketSettings {
  JacketForm form = JacketForm::off;
  bool shadow = false;      // computed and recorded, but not acting
  double gain_per_s = 1.0;  // Ks, 1/s
  double dead_zone = 0.0;   // z, CO units
  double max_mean_error = std::numeric_limits<double>::infinity();  // PV units
  double mean_error_time_s = 60.0;                                  // s

  friend bool operator==(const JacketSettings&, const JacketSettings&) = default;
};

struct JacketInputs {
  double error = 0.0;           // e, PV units
  double integral_rate = 0.0;   // Ki e, CO units/s
  double output = 0.0;          // u, CO units
  double valve_position = 0.0;  // x, CO units
  bool valve_position_valid = false;
};

class StickbandJacket {
 public:
  StickbandJacket(const JacketSettings& settings, double period_s) noexcept;

  // Another form starts afresh; other changes leave what was learnt.
  void configure(const JacketSettings& settings) noexcept;
  void reset() noexcept;

  // One period: w, CO units/s, whether or not it is to act (see settings().shadow).
  double step(const JacketInputs& in) noexcept;

  // Mean error above its limit: the jacket stands back.
  bool standing_back() const noexcept { return standing_back_; }
  double mean_error() const noexcept { return mean_error_; }
  const JacketSettings& settings() const noexcept { return settings_; }

 private:
  // The stem as the read-back shows it.
  struct Stem {
    bool known = false;
    bool stuck = false;       // now
    bool was_stuck = false;   // at any time since it last moved
    bool crossed = false;     // the error has changed sign against e_s since then
    double position = 0.0;    // x_r, CO units
    double output = 0.0;      // u_r, CO units
    double error = 0.0;       // one period ago, PV units
    double slip_error = 0.0;  // e_s, PV units; 0: not known
  };

  void watch_mean_error(double error) noexcept;
  void watch_stem(const JacketInputs& in) noexcept;
  double bounded_rate(const JacketInputs& in) const noexcept;
  double dwell_rate(const JacketInputs& in) const noexcept;

  JacketSettings settings_;
  double period_s_;
  double mean_error_ = 0.0;  // PV units
  bool standing_back_ = false;
  Stem stem_;
};

}  // namespace loopwarden::control
