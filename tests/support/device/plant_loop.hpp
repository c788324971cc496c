// SPDX-License-Identifier: Apache-2.0
// A loop on plant_device.py. Its plant and the controller's time constants are ten times as fast as
// those of plant 1.
#pragma once

#include <fmt/format.h>

#include <string>

#include "tests/support/text.hpp"

namespace loopwarden::tests {

inline std::string plant_loop(const std::string& link, double watchdog_s,
                              const std::string& tag = "FIC-101", double period_s = 0.05,
                              double max_age_s = 1.0) {
  constexpr const char* kLoop = R"(
loop: FIC-101
sample_time: {period}
process_variable: {{unit: L/min, range: [0, 10], max_age: {max_age}}}
controller:
  action: reverse
  kp: 0.3494
  ki: 0.4
  set_point: {{limits: [0, 9]}}
  output: {{unit: V, range: [0, 10], rate_limit: 5}}
start: {{mode: automatic, set_point: 5, output: hold}}
safe_actions:
  stop: 2.0
  bad_pv: {{hold_for: 0.3, then: 1.5}}
  output_lost: hold
  enable_open: 0
  recovery: previous_mode
  recovery_delay: 0.3
recording: {{enabled: false}}
io:
  backend: modbus
  poll_period: {period}
  transmitter:
    link: {link}
    unit: 1
    register: {{table: input, address: 0, type: f32}}
    status: {{table: input, address: 18, mask: 0xFFFF, value: 0}}
  positioner:
    link: {link}
    unit: 1
    command: {{address: 0, type: f32}}
    read_back: {{table: input, address: 20, type: f32}}
    comm_loss: {{timeout: {watchdog}, register: {{address: 10, type: u16, scale: 0.1}},
                 value: {watchdog}}}
)";
  const std::string text =
      fmt::format(kLoop, fmt::arg("link", link), fmt::arg("watchdog", watchdog_s),
                  fmt::arg("period", period_s), fmt::arg("max_age", max_age_s));
  return with(text, "FIC-101", tag);
}

}  // namespace loopwarden::tests
