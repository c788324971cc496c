// SPDX-License-Identifier: Apache-2.0
// Reads registers before a loop has a file: one line to `loopwardend --probe`, one line back.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "daemon/protocol/message.hpp"

namespace loopwarden::protocol {

// Words and units are those of the links in loopwardend.yaml and of a loop's registers.
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
  // read; silent: no answer; error: the device's exception; refused: the request was not sent
  std::string state{};
  std::string why{};
  std::vector<std::uint16_t> registers{};
  double raw = kNone;  // value of the registers by type and order; null: not a number
};

}  // namespace loopwarden::protocol
