// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace loopwarden::tests {

// A loop on the simulated plant 1 that records nothing.
inline std::string loop_file(const std::string& tag) {
  return "loop: " + tag + R"(
sample_time: 0.1
process_variable: {unit: L/min, range: [0, 10]}
controller:
  action: reverse
  kp: 0.35
  ki: 0.04
  set_point: {limits: [0, 9]}
  output: {unit: V, range: [0, 10]}
start: {mode: automatic, set_point: 5}
safe_actions: {stop: 0, bad_pv: hold, output_lost: hold, enable_open: 0, recovery: previous_mode}
recording: {enabled: false}
io: {backend: simulated, model: )" LOOPWARDEN_SOURCE_DIR R"(/config/examples/models/plant1.yaml}
)";
}

}  // namespace loopwarden::tests
