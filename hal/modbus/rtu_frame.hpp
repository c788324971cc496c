// SPDX-License-Identifier: Apache-2.0
// Finds the reply to a request in the bytes that a serial line delivers.
//
// A line may deliver additional bytes:
//   echo         the request itself, from a two-wire adapter whose receiver stays on while it sends
//   stray bytes  at most kMostStrayBytes, from a transceiver that changes direction or a line
//                without bias
// Stray bytes are fewer than the shortest reply, and an echo equals the request. Neither can
// therefore hide a reply to another request.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/modbus/pdu.hpp"

namespace loopwarden::hal::modbus {

inline constexpr std::size_t kCrcBytes = 2;
inline constexpr std::size_t kShortestReplyBytes = 5;  // unit, function, exception, CRC
inline constexpr std::size_t kMostStrayBytes = kShortestReplyBytes - 1;

// Returns the CRC of Modbus over Serial Line V1.02, section 6.2.2. It is sent low byte first.
std::uint16_t rtu_crc(std::span<const std::uint8_t> bytes) noexcept;

struct RtuFrame {
  std::array<std::uint8_t, kMaxRequestBytes + kCrcBytes> bytes{};
  std::size_t size = 0;
  std::span<const std::uint8_t> view() const noexcept { return {bytes.data(), size}; }
};
// Returns the request with its CRC, as it is on the line.
RtuFrame rtu_frame(const Request& request) noexcept;

struct RtuReply {
  enum class State : std::uint8_t {
    incomplete,  // more bytes may make a reply
    whole,       // as many bytes as a reply has, but no valid frame
    found        // a frame with a right CRC; check_reply() decides whether it answers the request
  };
  State state = State::incomplete;
  bool echo = false;                     // the request was echoed before it
  std::size_t stray = 0;                 // bytes before the frame that are not part of it
  std::span<const std::uint8_t> body{};  // unit and data, without the CRC
  std::size_t end = 0;                   // bytes of the line up to the end of the frame
};

// `echo_expected`: the line has echoed before. The reply to a write of function 6 equals the
// request. Only with this flag the first of two equal frames counts as the echo.
RtuReply find_reply(const Request& request, std::span<const std::uint8_t> line,
                    bool echo_expected) noexcept;

}  // namespace loopwarden::hal::modbus
