// SPDX-License-Identifier: Apache-2.0
// Fits the healthy loop and the loop with each valve fault to a window, from CO to PV.
//
// In % of the CO span, u = CO and p = PV over the gain, both as means of blocks of a few samples:
//
//   v = u                                        no fault
//   v = play(u, D)                               backlash
//   v = stick_slip(u, s, j)                      stiction, laws of He and of Choudhury
//   v = mean of four plays, mean width D         hysteresis, gradual; widths spread by a knee
//   v = u + offset while CO falls                hysteresis in the thesis's form
//   v' = clamp((min(u, L) - v) / l, -R, R)       low air supply
//   T y' + y = v(t - dead time)                  the loop's own lag
//   p = (1 + g) y - dL y' + dT dy/dT + a + b t + c exp(-t/T) + r
//
// g, dL and dT are the errors of the assumed gain, dead time and time constant; a prior keeps them
// small. a, b and c are load, drift and the initial state of the process. For each fault, size,
// form and start of the stem are searched for the least mean of r^2, eight candidates at a time.
// The search runs on a grid in blocks, for stiction also by evolution. Then it runs sample by
// sample with the dead time and lag that fit the best candidate. It doesn't depend on the start of
// the window, on set points, units or the controller.
//
//   p, u, v, r  % of CO span     D, s, offset  % of CO span, >= 0     R  %/s     l  s
//
// No errors. Without movement all fault models are equally good, and the evidence shows it.
// Limits: no loops that integrate, oscillate by themselves or have a nonlinear characteristic
// beyond the range of g; no dead time of more than half the window.
//
// Sources: the laws are those of model/plant, stepped without change, four stems in a row;
// R. Srinivasan et al., Ind. Eng. Chem. Res. 44 (2005), for the scheme of fitting them.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "model/numeric/loop_record.hpp"
#include "model/specialist/fit/loop_window.hpp"

namespace loopwarden::specialist {

// `other_process` is the healthy valve with an assumed process that may be wrong by half.
enum class FaultModel : std::size_t {
  healthy,
  other_process,
  backlash,
  stiction,
  hysteresis_width,
  hysteresis_offset,
  low_air_supply
};
inline constexpr std::size_t kFaultModels = 7;

struct FaultFit {
  double mse = 0.0;              // mean of r^2, (% of CO span)^2
  double innovation = 0.0;       // the same of r less its own slow course
  double size = 0.0;             // %: D, s, offset; of low air the largest |u - v|
  double shape = 0.0;            // stiction: j / s; low air: R, %/s; hysteresis: knee
  double limit = 0.0;            // low air: largest u less L, %, >= 0
  double gain_off = 0.0;         // g in standard deviations of its prior
  double dead_time_off = 0.0;    // dL likewise
  double lag_off = 0.0;          // dT likewise
  double dead_time_off_s = 0.0;  // dL
  double lag_off_s = 0.0;        // dT
};

struct WindowFits {
  bool usable = false;      // enough samples, no long gap, the loop fits the window
  double noise = 0.0;       // % of CO span, standard deviation of a block
  double co_range = 0.0;    // % of CO span, from its least to its largest block
  double co_travel = 0.0;   // %, sum of |changes| of the blocks
  double co_fastest = 0.0;  // %/s
  double reversals = 0.0;   // of CO by more than four times the noise
  double pv_range = 0.0;    // % of CO span
  double shut_share = 0.0;  // share of the blocks with CO at an end of its range
  std::array<FaultFit, kFaultModels> fits{};
  const FaultFit& of(FaultModel e) const { return fits[static_cast<std::size_t>(e)]; }
};

class WindowFitter {
 public:
  explicit WindowFitter(const LoopFacts& facts);

  // Fits the window. No allocation. A missing sample repeats the last one.
  WindowFits fit(const numeric::LoopView& window) noexcept;

  const LoopFacts& facts() const noexcept { return facts_; }

 private:
  struct Trial;
  struct Projection;
  template <class Stem>
  struct Row;
  class Search;
  // The process that one fault model fits, as a difference to the assumed one.
  struct Process {
    std::ptrdiff_t shift = 0;  // additional samples of dead time
    double dead_time_off_s = 0.0;
    double time_constant_s = 1.0;
    double keep = 0.0;  // factor of the lag per sample
  };
  // A search runs by blocks with the assumed process first, then sample by sample with the fitted
  // one.
  enum class Grain { block, sample };

  bool prepare(const numeric::LoopView& window, WindowFits& found) noexcept;
  void measure_movement(WindowFits& found) const noexcept;
  template <class Stem>
  void try_blocks(Trial* candidates, const Stem& first, const Stem& second) const noexcept;
  template <class Stem>
  void try_samples(Trial* candidates, const Stem& first, const Stem& second) const noexcept;
  void evaluate(Trial* candidates, Grain grain) const noexcept;
  void trace(const Trial& candidate) noexcept;
  void believe(double dead_time_off_s, double lag_off_s) noexcept;
  FaultFit fit_stem(FaultModel fault, const Trial& candidate, double noise) noexcept;
  FaultFit settle(FaultModel fault, const Trial& start, double noise) noexcept;
  Trial search_play(FaultModel fault) noexcept;
  Trial search_stiction() noexcept;
  Trial search_low_air() noexcept;
  void project(std::vector<double>& column) const noexcept;
  // Returns the index of the CO that moves PV's sample `delay_` + k.
  std::size_t place(std::size_t k) const noexcept {
    const auto from = static_cast<std::ptrdiff_t>(k) - process_.shift;
    return static_cast<std::size_t>(
        std::clamp<std::ptrdiff_t>(from, 0, static_cast<std::ptrdiff_t>(kWindowSamples) - 1));
  }
  float co_at(std::size_t k) const noexcept { return co_lanes_[place(k)]; }
  float falling_at(std::size_t k) const noexcept { return falling_[place(k)]; }

  LoopFacts facts_;
  std::size_t samples_per_block_;
  std::size_t delay_;                         // samples between CO and its first effect
  std::size_t blocks_;                        // in a window
  double block_s_;                            // s
  double keep_;                               // factor of the lag per block
  double mean_keep_;                          // of the lag, mean over a block
  std::array<std::vector<double>, 3> basis_;  // orthonormal: constant, trend, initial state
  std::array<std::vector<float>, 3> basis_lanes_;
  std::vector<double> pv_;       // whole window, holes filled, % of CO span
  std::vector<double> co_;       // the same
  std::vector<float> co_lanes_;  // without the mean of u_
  std::vector<float> falling_;   // 1 from the start of a fall of CO to its next rise
  std::vector<double> u_;        // blocks of CO, without their mean, delayed
  std::vector<float> u_lanes_;
  std::vector<double> target_;  // blocks of PV, projected
  std::vector<float> target_lanes_;
  double target_square_ = 0.0;
  double enough_ = 0.0;  // sum of r^2 at which a search ends
  double u_mean_ = 0.0;  // %
  double u_high_ = 0.0;  // % less the mean
  double u_low_ = 0.0;
  std::vector<double> v_;                       // of the traced candidate, every sample
  std::array<std::vector<double>, 4> columns_;  // y, y', dy/dT, offset's
  Process process_;
};

}  // namespace loopwarden::specialist
