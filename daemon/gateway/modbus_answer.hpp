// SPDX-License-Identifier: Apache-2.0
// A Modbus request as bytes to its answer as bytes: the server's codec, without sockets.
//
// Why not libmodbus's server: modbus_reply() of 3.1.6 sleeps for the response timeout (500 ms) when a
// request is malformed (libmodbus issue 874), so that one client with two bad packets a second takes the
// server from all others; its receive blocks until a frame is whole, so that one byte a second does the
// same; and its select() loop ends at descriptors above 1023 (issue 759). The eight functions below are
// less code than what would keep a blocking library from blocking, and a pure function can be fuzzed.
//
// Functions: 1, 2, 3, 4 (read), 5, 6, 15, 16 (write), 43/14 (device identification). What a request does
// is decided by a RegisterBank; this file knows lengths, limits and exceptions alone.
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
  illegal_function = 1,  // also: a write where writes are off, or from a peer that may not
  illegal_address = 2,
  illegal_value = 3,
  device_failure = 4,
  busy = 6  // not now: the loop's mode forbids it, or too many orders are waiting
};

// Who asks.
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

  // One value for each address; bits are 0 or 1. All values of a call are of one moment.
  virtual Exception read(registers::Table table, std::uint16_t address,
                         std::span<std::uint16_t> values) = 0;
  // All or nothing. Only for holding registers and coils, and for peers that may write.
  virtual Exception write(registers::Table table, std::uint16_t address,
                          std::span<const std::uint16_t> values, const Peer& peer) = 0;
};

// What function 43/14 says; the first 46 characters of each.
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

// An answer, and what it waits for: nothing (empty), or until `ready` says so. The servers ask each round.
struct Reply {
  static constexpr std::chrono::milliseconds kBetweenLooks{10};

  Reply(const Pdu& answer, std::function<bool()> when = {}) : pdu(answer), ready(std::move(when)) {}

  Pdu pdu;
  std::function<bool()> ready;
};

// `request` is a protocol data unit, 1 to kMostPduBytes bytes. There is always an answer.
Pdu answer(std::span<const std::uint8_t> request, RegisterBank& bank,
           const DeviceIdentity& identity, const Peer& peer);

}  // namespace loopwarden::daemon::gateway
