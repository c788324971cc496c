// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace loopwarden::tests {

// A loop without a record, on the simulated plant 1 or on another model.
inline std::string loop_file(const std::string& tag,
                             const std::string& model = LOOPWARDEN_SOURCE_DIR
                             "/examples/models/plant1.yaml",
                             const std::string& start = "{mode: automatic, set_point: 5}") {
  return "loop: " + tag + R"(
sample_time: 0.1
process_variable: {unit: L/min, range: [0, 10]}
controller:
  action: reverse
  kp: 0.35
  ki: 0.04
  set_point: {limits: [0, 9]}
  output: {unit: V, range: [0, 10]}
safe_actions: {stop: 0, bad_pv: hold, output_lost: hold, enable_open: 0, recovery: previous_mode}
recording: {enabled: false}
start: )" +
         start + "\nio: {backend: simulated, model: " + model + "}\n";
}

}  // namespace loopwarden::tests
