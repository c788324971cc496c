// SPDX-License-Identifier: Apache-2.0
// Registers that are read before a loop has a file: a line to `loopwardend --probe` and a line back.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "daemon/protocol/message.hpp"

namespace loopwarden::protocol {

// Words and units as in the links of loopwardend.yaml and in a loop's registers.
struct Probe {
  std::string transport{};  // tcp, rtu
  std::string host{};
  std::uint64_t port = 502;
  std::string device{};
  std::uint64_t baud = 19200;
  std::string parity{"even"};
  std::uint64_t stop_bits = 1;
  std::uint64_t unit = 1;
  std::string table{};  // input, holding
  std::uint64_t address = 0;
  std::string type{"u16"}, order{"abcd"};
};

struct Probed {
  std::string
      state{};  // read; silent: no answer; error: the device's exception; refused: nothing was sent
  std::string why{};
  std::vector<std::uint16_t> registers{};
  double raw = kNone;  // what they hold by type and order; null: no number
};

}  // namespace loopwarden::protocol
