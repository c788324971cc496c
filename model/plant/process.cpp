// SPDX-License-Identifier: Apache-2.0
#include "model/plant/process.hpp"

#include <cmath>

namespace loopwarden::plant {

Process::Process(const ProcessParameters& parameters, double period_s)
    : gain_(parameters.gain),
      keep_(std::exp(-period_s / parameters.time_constant_s)),
      whole_(static_cast<std::size_t>(parameters.dead_time_s / period_s)),
      line_(whole_ + 2) {
  const double fraction = parameters.dead_time_s / period_s - static_cast<double>(whole_);
  const double after = std::exp(-(1.0 - fraction) * period_s / parameters.time_constant_s);
  early_ = (after - keep_) * gain_;
  late_ = (1.0 - after) * gain_;
}

double Process::reset(double u) noexcept {
  line_.fill(u);
  return q_ = gain_ * u;
}

}  // namespace loopwarden::plant
