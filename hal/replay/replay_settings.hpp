// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace loopwarden::hal::replay {

struct ReplaySettings {
  std::string record;              // CSV file; its period must be the loop's sample time
  double sample_time_s = 0.1;      // s, > 0: the loop's
  bool repeat = false;             // start again at the end; otherwise PV becomes bad there
  double output_low = 0.0;         // CO units
  double output_high = 100.0;      // CO units, above output_low
  double output_resolution = 0.0;  // CO units, of the recorded converter; 0: continuous

  friend bool operator==(const ReplaySettings&, const ReplaySettings&) = default;
};

}  // namespace loopwarden::hal::replay
