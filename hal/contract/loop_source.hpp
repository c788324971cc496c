// SPDX-License-Identifier: Apache-2.0
// The contract of what is only read: a loop that another controller runs. Nothing here takes a value.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "hal/contract/device.hpp"
#include "hal/contract/sample.hpp"

namespace loopwarden::hal {

// A value and the life of what delivers it. Where values come on change alone, one that grew old while
// its source is alive still holds; one whose source has died does not.
struct SourceSample {
  Sample sample;
  std::int64_t alive_ns = 0;  // CLOCK_MONOTONIC, newest sign of life of the source; 0: none yet
};

struct SourceInputs {
  SourceSample process_variable;  // PV units
  SourceSample output;            // CO units
  SourceSample set_point;         // PV units; as below, meaningless where it is not fitted
  SourceSample stem;              // CO units
  SourceSample mode;              // a number of the other controller
};

// What the numbers of the other controller's mode mean; any other one is a third mode.
struct ModeValues {
  std::vector<double> automatic;
  std::vector<double> manual;

  friend bool operator==(const ModeValues&, const ModeValues&) = default;
};

inline bool holds(const std::vector<double>& values, double value) noexcept {
  return std::find(values.begin(), values.end(), std::round(value)) != values.end();
}

class LoopSource : public Device {
 public:
  // One thread, the same for all sources: newest inputs, whatever their age.
  virtual void read(SourceInputs& inputs) noexcept = 0;
};

}  // namespace loopwarden::hal
