// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hal/contract/pv_check_settings.hpp"
#include "hal/contract/sample.hpp"

namespace loopwarden::daemon::rt {

// Judges whether the newest sample of PV can be believed: its age, that it is a number, inside the
// range, and not frozen while the output moves.
class PvGuard {
 public:
  explicit PvGuard(const hal::PvCheckSettings& settings) noexcept : settings_(settings) {}

  void configure(const hal::PvCheckSettings& settings) noexcept { settings_ = settings; }

  // The sample with its quality lowered where a check fails; never raised. `output_span` and
  // `output` in CO units.
  hal::Sample check(hal::Sample sample, double output, double output_span,
                    std::int64_t now_ns) noexcept;

  // The output is known to stand elsewhere than believed by so much, CO units: no movement of it
  // that PV would have to answer.
  void output_learned(double difference) noexcept;

 private:
  hal::Sample judged(hal::Sample sample, double output, double output_span,
                     std::int64_t now_ns) noexcept;
  bool frozen(const hal::Sample& sample, double output, double output_span,
              std::int64_t now_ns) noexcept;

  hal::PvCheckSettings settings_;
  bool seen_ = false;         // a value, ever
  double still_value_ = 0.0;  // PV units, since still_since_ns_
  double output_then_ = 0.0;  // CO units, when PV last changed
  std::int64_t still_since_ns_ = 0;
  // What passes while there is no value to look at tells nothing of a frozen one.
  bool blind_ = false;
  std::int64_t blind_since_ns_ = 0;
  double output_when_blind_ = 0.0;  // CO units
};

}  // namespace loopwarden::daemon::rt
