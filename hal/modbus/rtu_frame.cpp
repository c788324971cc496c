// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/rtu_frame.hpp"

#include <algorithm>

namespace loopwarden::hal::modbus {
namespace {

constexpr std::size_t kWriteReplyBytes = 8;  // unit, function, address, value or count, CRC

bool has_right_crc(std::span<const std::uint8_t> frame) noexcept {
  const std::uint16_t crc = rtu_crc(frame.first(frame.size() - kCrcBytes));
  return frame[frame.size() - 2] == (crc & 0xFFU) && frame.back() == crc >> 8U;
}

std::size_t reply_length(const Request& request) noexcept {
  if (!request.read) return kWriteReplyBytes;
  return kShortestReplyBytes + reply_bytes(*request.read, request.count);
}

// Returns the end of the request in the received bytes if it was echoed, otherwise 0.
std::size_t echo_end(const Request& request, std::span<const std::uint8_t> line,
                     bool echo_expected) noexcept {
  const RtuFrame sent = rtu_frame(request);
  const bool like_its_reply = !request.read && sent.size == kWriteReplyBytes;
  if (like_its_reply && !echo_expected) return 0;
  for (std::size_t at = 0; at <= kMostStrayBytes && at + sent.size <= line.size(); ++at) {
    if (std::equal(sent.bytes.begin(), sent.bytes.begin() + static_cast<long>(sent.size),
                   line.begin() + static_cast<long>(at))) {
      return at + sent.size;
    }
  }
  return 0;
}

// Returns the frame at `at`; empty if there is no frame. `own`: only a frame of the requested unit
// and function.
std::span<const std::uint8_t> frame_at(const Request& request, std::span<const std::uint8_t> line,
                                       std::size_t at, bool own) noexcept {
  if (line.size() < at + kShortestReplyBytes) return {};
  const bool exception = (line[at + 1] & kExceptionFlag) != 0;
  const std::size_t length = exception ? kShortestReplyBytes : reply_length(request);
  if (line.size() < at + length) return {};
  const bool asked =
      line[at] == request.unit && (line[at + 1] & ~kExceptionFlag) == request.function;
  const auto frame = line.subspan(at, length);
  return (!own || asked) && has_right_crc(frame) ? frame : std::span<const std::uint8_t>{};
}

}  // namespace

std::uint16_t rtu_crc(std::span<const std::uint8_t> bytes) noexcept {
  constexpr unsigned kPolynomial = 0xA001;
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? (crc >> 1U) ^ kPolynomial : crc >> 1U;
  }
  return static_cast<std::uint16_t>(crc);
}

RtuFrame rtu_frame(const Request& request) noexcept {
  RtuFrame frame;
  std::copy_n(request.bytes.begin(), request.size, frame.bytes.begin());
  const std::uint16_t crc = rtu_crc(request.view());
  frame.bytes[request.size] = static_cast<std::uint8_t>(crc & 0xFFU);
  frame.bytes[request.size + 1] = static_cast<std::uint8_t>(crc >> 8U);
  frame.size = request.size + kCrcBytes;
  return frame;
}

RtuReply find_reply(const Request& request, std::span<const std::uint8_t> line,
                    bool echo_expected) noexcept {
  RtuReply reply;
  const std::size_t from = echo_end(request, line, echo_expected);
  reply.echo = from > 0;
  for (const bool own : {true, false}) {
    for (std::size_t stray = 0; stray <= kMostStrayBytes; ++stray) {
      const auto frame = frame_at(request, line, from + stray, own);
      if (frame.empty()) continue;
      const std::size_t before_echo = reply.echo ? from - rtu_frame(request).size : 0;
      reply.state = RtuReply::State::found;
      reply.stray = stray + before_echo;
      reply.body = frame.first(frame.size() - kCrcBytes);
      reply.end = from + stray + frame.size();
      return reply;
    }
  }
  if (line.size() >= from + reply_length(request)) reply.state = RtuReply::State::whole;
  return reply;
}

}  // namespace loopwarden::hal::modbus
