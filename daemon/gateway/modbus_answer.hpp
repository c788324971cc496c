// SPDX-License-Identifier: Apache-2.0
// Converts a Modbus request (bytes) to its answer (bytes): the server's codec, without sockets.
//
// Reasons against libmodbus's server:
// - modbus_reply() of 3.1.6 sleeps for the response timeout (500 ms) at a malformed request
//   (libmodbus issue 874). One client with two bad packets per second blocks all others.
// - Its receive blocks until a frame is complete, so one byte per second has the same effect.
// - Its select() loop ends at descriptors above 1023 (issue 759).
// The eight functions here need less code than keeping a blocking library from blocking. A pure
// function can also be fuzzed.
//
// Functions: 1, 2, 3, 4 (read), 5, 6, 15, 16 (write), 43/14 (device identification). A RegisterBank
// executes requests. This file only handles lengths, limits and exceptions.
//
// Source: MODBUS Application Protocol Specification V1.1b3, section 6.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <utility>

#include "daemon/registers/register_map.hpp"

namespace loopwarden::daemon::gateway {

inline constexpr std::size_t kMostPduBytes = 253;
inline constexpr std::size_t kMostReadRegisters = 125;
inline constexpr std::size_t kMostReadBits = 2000;
inline constexpr std::size_t kMostWriteRegisters = 123;
inline constexpr std::size_t kMostWriteBits = 1968;

enum class Exception : std::uint8_t {
  none = 0,
  illegal_function = 1,  // also: a write while writes are off, or from a peer without write access
  illegal_address = 2,
  illegal_value = 3,
  device_failure = 4,
  busy = 6  // not now: the loop's mode forbids it, or too many commands are waiting
};

// The sender of a request.
struct Peer {
  std::string name;  // "192.168.1.5:40312", for the journal
  bool may_write = false;
};

class RegisterBank {
 public:
  RegisterBank() = default;
  RegisterBank(const RegisterBank&) = delete;
  RegisterBank& operator=(const RegisterBank&) = delete;
  virtual ~RegisterBank() = default;

  // Returns one value per address; bits are 0 or 1. All values of a call are from one moment.
  virtual Exception read(registers::Table table, std::uint16_t address,
                         std::span<std::uint16_t> values) = 0;
  // Writes all values or none. Only for holding registers and coils, and for peers with write
  // access.
  virtual Exception write(registers::Table table, std::uint16_t address,
                          std::span<const std::uint16_t> values, const Peer& peer) = 0;
};

// Texts of function 43/14; the first 46 characters of each are sent.
struct DeviceIdentity {
  std::string vendor = "Loopwarden";
  std::string product_code = "loopwardend";
  std::string revision;
  std::string product_name = "Control loops and valve monitor";
};

struct Pdu {
  std::array<std::uint8_t, kMostPduBytes> bytes{};
  std::size_t size = 0;
  std::span<const std::uint8_t> view() const noexcept { return {bytes.data(), size}; }
};

// An answer and its condition: `ready` is empty, or the answer waits until `ready` returns true.
// The servers check it each round.
struct Reply {
  static constexpr std::chrono::milliseconds kBetweenLooks{10};

  Reply(const Pdu& answer, std::function<bool()> when = {}) : pdu(answer), ready(std::move(when)) {}

  Pdu pdu;
  std::function<bool()> ready;
};

// Returns the answer to any request. `request` is a protocol data unit of 1 to kMostPduBytes bytes.
Pdu answer(std::span<const std::uint8_t> request, RegisterBank& bank,
           const DeviceIdentity& identity, const Peer& peer);

}  // namespace loopwarden::daemon::gateway
