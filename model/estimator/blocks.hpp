// SPDX-License-Identifier: Apache-2.0
// A record of one loop as a fit reads it: CO at every sample, and PV as means over blocks of D
// samples.
//
//   Y(b) = mean of y(k) over the used samples of block b      var of its noise = sigma^2 / n(b)
//
//   y  PV, PV units     n(b)  used samples of the block; a block without any is missing
//   D  samples per block: a tenth of the time constant, and at least kFewest blocks
//
// The noise is that of neighbouring samples, so a slow signal does not change it:
//   sigma = median |y(k+1) - 2 y(k) + y(k-1)| / (0.6745 sqrt 6)
//
// Holes, spikes and readings at an end of the range are samples that are not used. The likelihood
// skips them; no value replaces them.
// Source of the median's factor: Huber, Robust Statistics (1981).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "model/plant/loop_model.hpp"

namespace loopwarden::estimator {

// Columns of equal length.
struct Observed {
  double period_s = 0.1;
  std::vector<double> co;  // CO units, complete
  std::vector<double> pv;  // PV units
  std::vector<bool> used;  // the samples of PV that count
};

// A record, `rest_s` without PV, and a later record with the same period. Between them CO moves
// evenly from the last value of the first one to the first value of the second one.
Observed joined(const Observed& record, const Observed& later, double rest_s);

class Blocks {
 public:
  // The first `samples` samples. `noise_rms`: of one sample, PV units.
  Blocks(const Observed& observed, std::size_t samples, std::size_t per_block, double noise_rms);

  std::size_t count() const noexcept { return pv_.size(); }
  std::size_t samples() const noexcept { return samples_; }
  std::size_t per_block() const noexcept { return per_block_; }
  double period_s() const noexcept { return period_s_ * static_cast<double>(per_block_); }
  double sample_time_s() const noexcept { return period_s_; }
  double duration_s() const noexcept { return period_s() * static_cast<double>(count()); }
  // Middle of a block, s of the record.
  double time_s(std::size_t block) const noexcept {
    return period_s() * (static_cast<double>(block) + 0.5) - 0.5 * period_s_;
  }
  const std::vector<double>& pv() const noexcept { return pv_; }           // 0 where missing
  const std::vector<double>& variance() const noexcept { return noise_; }  // 0: missing block

  // Means of a signal over the same samples as those of PV; 0 for a missing block.
  void average(std::span<const double> signal, std::span<double> means) const noexcept;

 private:
  double period_s_;
  std::size_t samples_;
  std::size_t per_block_;
  std::vector<double> weight_;  // of each sample
  std::vector<double> pv_;      // PV units
  std::vector<double> noise_;   // PV units squared
};

// The record without its spikes: excursions of PV of up to `longest` samples that start with a jump
// of more than `least`, PV units. A longer one is a disturbance.
Observed without_spikes(Observed observed, double least, std::size_t longest);

// Samples per block for a loop of this time constant.
std::size_t block_length(double time_constant_s, double period_s, std::size_t samples);

// Noise of one sample, PV units. `resolution`: of the transmitter, PV units.
double noise_of(const Observed& observed, std::size_t samples, double resolution, double span);

}  // namespace loopwarden::estimator
