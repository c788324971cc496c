// SPDX-License-Identifier: Apache-2.0
#include "config/serial_line_reader.hpp"

#include <fmt/format.h>

#include <array>

namespace loopwarden::config {
namespace {

using hal::modbus::Parity;

constexpr std::array kParities{Choice<Parity>{"none", Parity::none},
                               Choice<Parity>{"even", Parity::even},
                               Choice<Parity>{"odd", Parity::odd}};
constexpr std::array kBauds{Choice<int>{"1200", 1200},   Choice<int>{"2400", 2400},
                            Choice<int>{"4800", 4800},   Choice<int>{"9600", 9600},
                            Choice<int>{"19200", 19200}, Choice<int>{"38400", 38400},
                            Choice<int>{"57600", 57600}, Choice<int>{"115200", 115200}};
constexpr std::array kStopBits{Choice<int>{"1", 1}, Choice<int>{"2", 2}};

}  // namespace

void read_serial_line(MapReader& in, hal::modbus::LinkSettings& line) {
  line.transport = hal::modbus::Transport::rtu;
  const Value<std::string> device =
      in.need_text("device", "serial device, such as /dev/serial/by-id/...");
  line.device = device;
  if (device.given && device.valid && !device.value.starts_with('/')) {
    in.error("device", fmt::format("must be an absolute path (got '{}')", quotable(device.value)));
  }
  line.baud = in.one_of("baud", kBauds, "line speed, 8 data bits", line.baud);
  line.parity = in.one_of("parity", kParities, "parity bit", line.parity);
  line.stop_bits = in.one_of("stop_bits", kStopBits, "stop bits", line.stop_bits);
  line.rs485 = in.flag("rs485", "let the kernel's driver switch the transmitter", line.rs485);
}

}  // namespace loopwarden::config
