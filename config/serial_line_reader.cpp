// SPDX-License-Identifier: Apache-2.0
#include "config/serial_line_reader.hpp"

#include <fmt/format.h>

#include <array>

namespace loopwarden::config {
namespace {

using hal::modbus::Parity;

constexpr auto kParities = std::to_array<Choice<Parity>>(
    {{"none", Parity::none}, {"even", Parity::even}, {"odd", Parity::odd}});
constexpr auto kBauds = std::to_array<Choice<int>>({{"1200", 1200},
                                                    {"2400", 2400},
                                                    {"4800", 4800},
                                                    {"9600", 9600},
                                                    {"19200", 19200},
                                                    {"38400", 38400},
                                                    {"57600", 57600},
                                                    {"115200", 115200}});
constexpr auto kStopBits = std::to_array<Choice<int>>({{"1", 1}, {"2", 2}});

}  // namespace

void read_serial_line(MapReader& in, hal::modbus::LinkSettings& line) {
  line.transport = hal::modbus::Transport::rtu;
  const Value<std::string> device =
      in.need_text("device", "serial device, such as /dev/serial/by-id/...");
  line.device = device;
  if (device.given && device.valid && !device.value.starts_with('/')) {
    in.error("device", fmt::format("must be an absolute path (got '{}')", quotable(device.value)));
  }
  in.set_one_of("baud", kBauds, "line speed, 8 data bits", line.baud);
  in.set_one_of("parity", kParities, "parity bit", line.parity);
  in.set_one_of("stop_bits", kStopBits, "stop bits", line.stop_bits);
  in.set_flag("rs485", "let the kernel's driver switch the transmitter", line.rs485);
}

}  // namespace loopwarden::config
