// SPDX-License-Identifier: Apache-2.0
// Short files to vary, and the readers' messages about them.
#pragma once

#include <catch2/catch.hpp>
#include <filesystem>
#include <string>

#include "config/config_reader.hpp"
#include "config/loop_model_reader.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/text.hpp"

namespace loopwarden::config::test {

inline const std::string kModel = R"(sample_time: 0.1
controller:
  kp: 0.35
  ki: 0.04
  output: [0, 10]
process:
  gain: 1.2264
  time_constant: 1.7
  dead_time: 2.6
transmitter:
  range: [0, 10]
)";

// Its io section begins at line 16.
inline const std::string kLoopHead = R"(loop: FIC-101
sample_time: 0.1
process_variable: {unit: L/min, range: [0, 10]}
controller:
  action: reverse
  kp: 0.35
  ki: 0.04
  set_point: {limits: [0, 9]}
  output: {unit: V, range: [0, 10], limits: [1, 9]}
start: {mode: manual, set_point: 5, output: 1}
safe_actions:
  stop: 1
  bad_pv: hold
  output_lost: hold
  enable_open: 1
)";

inline const std::string kModbusLoop = kLoopHead + R"(io:
  backend: modbus
  transmitter:
    link: skid
    unit: 1
    register: {table: input, address: 0, type: f32}
  positioner:
    link: skid
    unit: 2
    command: {address: 100, type: u16, scale: 0.001}
    comm_loss: {timeout: 2, set_by: device}
)";

inline const std::string kAnalogLoop = kLoopHead + R"(io:
  backend: analog
  input: {device: adc, channel: voltage0, units_per_ma: 250}
  output:
    device: dac
    channel: current1
    comm_loss: none_accepted
)";

inline DaemonConfig daemon() {
  hal::modbus::LinkSettings tcp;
  tcp.name = "skid";
  tcp.host = "127.0.0.1";
  hal::modbus::LinkSettings rtu;
  rtu.name = "line";
  rtu.transport = hal::modbus::Transport::rtu;
  rtu.device = "/dev/ttyS0";
  DaemonConfig daemon;
  daemon.links = {{"skid", tcp}, {"line", rtu}};
  daemon.feeders = {{"opcua", {.user = "loopwarden-opcua", .uid = 990}}};
  return daemon;
}

using tests::with;

template <class T>
std::string said(const Loaded<T>& loaded) {
  const bool failed = has_errors(loaded.diagnostics);
  CHECK(loaded.value.has_value() != failed);
  return to_text(loaded.diagnostics);
}

inline std::string said_of_model(const std::string& text) {
  return said(read_model_text("m.yaml", text));
}
inline std::string said_of_loop(const std::string& text) {
  return said(read_loop_text("loop.yaml", text, daemon()));
}
inline std::string said_of_daemon(const std::string& text) {
  return said(read_daemon_text("d.yaml", text));
}

class ScratchFolder : public tests::TemporaryFolder {
 public:
  void write(const std::string& name, const std::string& text) const {
    tests::write_file(*this / name, text);
  }
  // Returns the diagnostics without the folder's own name.
  std::string relative(std::string text) const {
    const std::string prefix = path().string() + "/";
    for (std::size_t at = text.find(prefix); at != std::string::npos; at = text.find(prefix)) {
      text.erase(at, prefix.size());
    }
    return text;
  }
};

}  // namespace loopwarden::config::test
