// SPDX-License-Identifier: Apache-2.0
// Parts of a simulated loop in addition to process and controller: a sticking valve, loads, a
// neighbour.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "model/numeric/random.hpp"

namespace loopwarden::lab {

using numeric::Random;

inline constexpr double kPi = std::numbers::pi;

// Friction of the valve. It differs from the laws that are fitted: its size varies from slip to
// slip, and a slip takes time.
class Friction {
 public:
  enum class Law { none, choudhury, he, play, creeping };
  Friction(Law law, double s, double j, double scatter, Random random)
      : law_(law), fs_((s + j) / 2.0), fd_((s - j) / 2.0), scatter_(scatter), random_(random) {
    draw();
  }
  void reset(double u) { x_ = last_ = u; }
  std::size_t slips() const { return slips_; }

  double step(double u) {
    const double before = x_;
    const double r = u - x_;
    switch (law_) {
      case Law::none: x_ = u; break;
      case Law::play: x_ = std::clamp(x_, u - fs_ * draw_, u + fs_ * draw_); break;
      case Law::he:
        if (std::abs(r) > fs_ * draw_) x_ = u - std::copysign(fd_ * draw_, r);
        break;
      case Law::choudhury: {
        const double change = u - last_;
        if (direction_ != 0.0 && change * direction_ <= 0.0) direction_ = 0.0;
        if (direction_ == 0.0 && std::abs(r) > fs_ * draw_) direction_ = std::copysign(1.0, r);
        if (direction_ != 0.0) x_ = u - direction_ * fd_ * draw_;
        break;
      }
      case Law::creeping:  // slips, but creeps under force before the slip
        if (std::abs(r) > fs_ * draw_) {
          x_ = u - std::copysign(fd_ * draw_, r);
        } else if (std::abs(r) > fd_ * draw_) {
          x_ += 0.003 * r;
        }
        break;
    }
    last_ = u;
    if (law_ != Law::play && std::abs(x_ - before) > 0.4 * (fs_ - fd_) && direction_ == 0.0) slip();
    if (law_ == Law::choudhury && direction_ != 0.0 && moved_ != direction_) slip();
    moved_ = direction_;
    if (law_ == Law::play && (x_ - before) * travel_ < 0.0) ++slips_;
    if (x_ != before) travel_ = x_ - before;
    return x_;
  }

 private:
  void slip() {
    ++slips_;
    draw();
  }
  void draw() { draw_ = std::clamp(1.0 + scatter_ * random_.normal(), 0.3, 2.0); }

  Law law_;
  double fs_;
  double fd_;
  double scatter_;
  Random random_;
  double draw_ = 1.0;
  double x_ = 0.0;
  double last_ = 0.0;
  double direction_ = 0.0;
  double moved_ = 0.0;
  double travel_ = 0.0;
  std::size_t slips_ = 0;
};

// An external oscillation: not sinusoidal, with varying period and amplitude.
class Oscillator {
 public:
  enum class Shape { sine, harmonics, square, triangle, sawtooth, pulses };
  Oscillator(Shape shape, double amplitude, double period, double jitter, double swelling,
             double smoothing, Random random)
      : shape_(shape),
        amplitude_(amplitude),
        period_(period),
        jitter_(jitter),
        swelling_(swelling),
        smoothing_(smoothing),
        random_(random),
        phase_(random_.uniform()),
        second_(random_.uniform(0.0, 0.35)),
        third_(random_.uniform(-0.2, 0.2)),
        duty_(random_.uniform(0.3, 0.7)) {}

  void stop() { amplitude_ = 0.0; }
  double step(double dt) {
    if (amplitude_ <= 0.0) return 0.0;
    phase_ += dt / period_ + jitter_ * std::sqrt(dt / period_) * random_.normal();
    phase_ -= std::floor(phase_);
    const double forget = std::exp(-dt / (4.0 * period_));
    swell_ = forget * swell_ + std::sqrt(1.0 - forget * forget) * swelling_ * random_.normal();
    const double angle = 2.0 * kPi * phase_;
    double value = 0.0;
    switch (shape_) {
      case Shape::sine: value = std::sin(angle); break;
      case Shape::harmonics:
        value = std::sin(angle) + second_ * std::sin(2.0 * angle + 1.0) +
                third_ * std::sin(3.0 * angle);
        break;
      case Shape::square: value = phase_ < duty_ ? 1.0 : -1.0; break;
      case Shape::triangle: value = phase_ < 0.5 ? 4.0 * phase_ - 1.0 : 3.0 - 4.0 * phase_; break;
      case Shape::sawtooth: value = 2.0 * phase_ - 1.0; break;
      case Shape::pulses: value = phase_ < 0.2 * duty_ + 0.05 ? 2.0 : -0.3; break;
    }
    const double b = smoothing_ > 0.0 ? 1.0 - std::exp(-dt / (smoothing_ * period_)) : 1.0;
    first_ += b * (value - first_);
    smooth_ += b * (first_ - smooth_);
    return amplitude_ * std::max(0.0, 1.0 + swell_) * smooth_;
  }

 private:
  Shape shape_;
  double amplitude_, period_, jitter_, swelling_, smoothing_;
  Random random_;
  double phase_, second_, third_, duty_;
  double swell_ = 0.0, first_ = 0.0, smooth_ = 0.0;
};

// First-order noise of given standard deviation and correlation time.
class Wander {
 public:
  Wander(double deviation, double time, double dt, Random random)
      : forget_(std::exp(-dt / time)),
        drive_(deviation * std::sqrt(1.0 - forget_ * forget_)),
        random_(random),
        state_(deviation * random_.normal()) {}
  double step() { return state_ = forget_ * state_ + drive_ * random_.normal(); }

 private:
  double forget_, drive_;
  Random random_;
  double state_;
};

inline constexpr std::array<const char*, 6> kShapeNames{"sine",     "harmonics", "square",
                                                        "triangle", "sawtooth",  "pulses"};

// Another flow on the same header: if one flow increases, the other decreases. Its valve sticks and
// cycles under its integral controller. CO units relative to the working point.
class Neighbour {
 public:
  // `coupling`: effect of each flow on the other, 0: no neighbour. `closed_time`: closed-loop time
  // without stiction.
  Neighbour(double coupling, double band, double closed_time, double dt, Random random)
      : coupling_(coupling),
        rate_(dt / closed_time),
        friction_(Friction::Law::he, band, 0.6 * band, 0.15, random) {
    friction_.reset(0.0);
    output_ = band * 0.3;
  }
  // Returns the load on this loop.
  double step(double opened_here) {
    if (coupling_ <= 0.0) return 0.0;
    const double flow = friction_.step(output_) - coupling_ * opened_here;
    output_ -= rate_ * flow;
    return -coupling_ * flow;
  }

 private:
  double coupling_, rate_;
  Friction friction_;
  double output_ = 0.0;
};

}  // namespace loopwarden::lab
