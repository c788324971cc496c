// SPDX-License-Identifier: Apache-2.0
// Whitens what a model leaves of PV when an unmeasured load wanders under white noise, and a
// healthy valve does not stand quite where CO puts it.
//
//   r(k) = d(k) + q(k) + w(k),   d(k+1) = a d(k) + v(k),   a = exp(-h/T)
//                                q(k+1) = b q(k) + u(k),   b = exp(-h/P)
//   var w = s^2,  var v = s^2 rho^2 T/(2h) (1 - a^2) -> s^2 rho^2 for h << T,  var u = s^2 g^2 (1 - b^2),
//   d(0), q(0) ~ stationary
//
//   r  residual, PV units     d  load, PV units     w  noise and rounding, standard deviation s
//   q  what a healthy valve leaves, PV units: friction holds the stem beside CO until the loop moves it on
//   rho  load ratio, -: standard deviation of the load's step in one period over s; 0: no load
//   g  valve ratio, -: standard deviation of q over s; 0: none     P  time with which q is forgotten, s
//   h  period, s     T  time with which the load returns to its mean, 300 s
//
// Without q only a load can whiten what a valve leaves for seconds, and a load lets go of PV's
// level for minutes: then a wrong effect that misses the level is as good as the right one.
//
// The Kalman filter of this model turns r into independent innovations e(k) of variance s^2;
// samples that are not used are skipped. Every regressor goes through the same filter, so that
// ordinary least squares on the outputs is maximum likelihood:
//   -2 log L = N log s^2 + log_determinant + sum e^2 / s^2
//
// What it can't do: a load that comes in steps or bursts is whitened badly, and shows in e.
//
// Source: Kalman (1960); Kristensen, Madsen and Jorgensen, Comput. Chem. Eng. 28 (2004) 1431-1449,
// for the use of a disturbance state in finding what a model lacks.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace loopwarden::gap {

class LoadFilter {
 public:
  static constexpr double kReturnTime_s = 300.0;

  // What a healthy valve leaves.
  struct Valve {
    double ratio = 0.0;      // g
    double forgets_s = 1.0;  // P
  };

  // `used[k]` false: sample k is skipped.
  LoadFilter(const std::vector<bool>& used, double period_s, double load_ratio, Valve valve);
  LoadFilter(const std::vector<bool>& used, double period_s, double load_ratio)
      : LoadFilter(used, period_s, load_ratio, Valve{}) {}

  // The innovations of the used samples, `count()` of them.
  void whiten(std::span<const double> in, std::span<double> out) const noexcept;

  // The same of several columns at once, which hides what each waits for.
  void whiten(const std::vector<std::vector<double>>& in,
              std::vector<std::vector<double>>& out) const;

  std::size_t count() const noexcept { return steps_.size(); }
  double log_determinant() const noexcept { return log_determinant_; }
  double load_ratio() const noexcept { return load_ratio_; }
  double valve_ratio() const noexcept { return valve_ratio_; }

 private:
  struct Step {
    std::size_t sample;
    double keep, keep_valve;  // prediction over the samples since the used one before
    double gain, gain_valve;  // of the update
    double scale;             // 1 / innovation's standard deviation in units of s
  };
  template <std::size_t N, bool with_valve>
  void whiten_lanes(const std::vector<double>* in, std::vector<double>* out) const noexcept;

  template <bool with_valve>
  void whiten_columns(const std::vector<std::vector<double>>& in,
                      std::vector<std::vector<double>>& out) const;

  double load_ratio_;
  double valve_ratio_;
  double log_determinant_ = 0.0;
  std::vector<Step> steps_;
};

}  // namespace loopwarden::gap
