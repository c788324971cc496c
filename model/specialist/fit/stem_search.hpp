// SPDX-License-Identifier: Apache-2.0
// WindowFitter's search for a stem: the candidates, and the best ones so far.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "model/specialist/fit/window_fitter.hpp"

namespace loopwarden::specialist {

inline constexpr std::size_t kStems = 8;  // candidates tried in step
inline constexpr double kRatio = 1.6;     // of the grid's sizes

// A candidate stem: its law, its numbers in % and blocks, and the start of the stem, -1 to 1 of the
// range that friction or backlash leaves free.
struct WindowFitter::Trial {
  enum class Law { none, play, plays, he, choudhury, low_air };
  Law law = Law::none;
  double size = 0.0;
  double shape = 0.0;
  double start = 0.0;
  double limit = 1e9;  // % less the mean of u
  double lag_s = 0.0;
  double misfit = std::numeric_limits<double>::infinity();

  // Calls `walk` with a maker of the plant's stem of `law`, at rest at `u0` and stepped every
  // `period_s`. The maker is a function of `put`, which turns a value of the candidates into a
  // number or a row of numbers.
  template <class Walk>
  static void with_stem(Law law, double u0, double period_s, Walk walk) noexcept;
};

// A search that keeps the best candidates.
class WindowFitter::Search {
 public:
  Search(const WindowFitter& fitter, Grain grain) : fitter_(fitter), grain_(grain) {}

  // Tries eight candidates. `change` makes each of them from the best one so far; i is its lane.
  template <class Change>
  void try_eight(Change change) {
    for (std::size_t i = 0; i < kStems; ++i) {
      lanes_[i] = best;
      change(lanes_[i], static_cast<double>(i));
    }
    fitter_.evaluate(lanes_.data(), grain_);
    Trial found = best;
    for (const Trial& c : lanes_) {
      if (c.misfit < found.misfit) found = c;
    }
    best = found;
  }
  void sizes(double step, Trial::Law law) {
    try_eight([&](Trial& c, double i) {
      c.law = law;
      c.size *= std::pow(kRatio, step * (i - 3.5));
    });
  }
  void starts(double step) {
    try_eight(
        [&](Trial& c, double i) { c.start = std::clamp(c.start + step * (i - 3.5), -1.0, 1.0); });
  }
  // Keeps s + j, the value at which the stem starts to move.
  void jumps(double low, double step, Trial::Law law) {
    try_eight([&](Trial& c, double i) {
      c.law = law;
      const double shape = std::clamp(low + step * i, 0.0, 1.0);
      c.size *= (1.0 + c.shape) / (1.0 + shape);
      c.shape = shape;
    });
  }
  void knees(double low, double step) {
    try_eight([&](Trial& c, double i) { c.shape = std::clamp(low + step * i, -1.2, 0.7); });
  }
  void air(double step, double range) {
    try_eight([&](Trial& c, double i) { c.limit += step * 0.3 * range * (i - 3.5); });
    try_eight([&](Trial& c, double i) { c.shape *= std::pow(1.6, step * (i - 3.5)); });
    try_eight([&](Trial& c, double i) { c.lag_s *= std::pow(2.0, 2.0 * step * (i - 3.5)); });
    // For a stem that was still moving when the window began.
    try_eight([&](Trial& c, double i) { c.start += step * 0.5 * range * (i - 3.5); });
  }

  // Keeps those of the last eight candidates that are among the best eight of all.
  void keep() {
    const auto worse = [](const Trial& a, const Trial& b) { return a.misfit < b.misfit; };
    for (const Trial& c : lanes_) {
      Trial& worst = *std::max_element(kept_.begin(), kept_.end(), worse);
      if (c.misfit < worst.misfit) worst = c;
    }
  }
  void keep_best_alone() { kept_.fill(best); }
  // Differential evolution of a sticking stem. The error jumps with each slip that appears or
  // disappears, so a descent ends early. Starts from the kept candidates and as many random ones.
  void evolve(int generations);

  Trial best;

 private:
  const WindowFitter& fitter_;
  Grain grain_;
  std::array<Trial, kStems> lanes_;
  std::array<Trial, kStems> kept_;
};

}  // namespace loopwarden::specialist
