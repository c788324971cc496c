// SPDX-License-Identifier: Apache-2.0
// A device that answers with any bytes. The bytes pass through a socket or a pseudo-terminal to the
// transport of the bus threads. A reply may count only if a separate check, written from the Modbus
// specification, accepts it as the answer to this request.
#include <fcntl.h>
#include <pty.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <vector>

#include "hal/modbus/bus_waiter.hpp"
#include "hal/modbus/modbus_transport.hpp"
#include "hal/modbus/pdu.hpp"
#include "hal/modbus/rtu_frame.hpp"

namespace {

using namespace loopwarden::hal::modbus;
using Bytes = std::span<const std::uint8_t>;

[[noreturn]] void fail(const char* what) {
  std::fprintf(stderr, "%s\n", what);
  std::abort();
}

std::size_t word(Bytes bytes, std::size_t at) {
  return static_cast<std::size_t>(bytes[at]) * 256 + bytes[at + 1];
}

// Returns the length of the unit and data at the start of `bytes` if they carry a value for
// `request`, otherwise 0.
std::size_t answer_length(Bytes bytes, const Request& request) {
  if (bytes.size() < 3 || bytes[0] != request.unit) return 0;
  if (bytes[1] != request.function) return 0;
  if (!request.read) {
    const bool echo = bytes.size() >= 6 &&
                      std::equal(bytes.begin() + 2, bytes.begin() + 6, request.bytes.begin() + 2);
    return echo ? 6 : 0;
  }
  const std::size_t length = 3U + bytes[2];
  return bytes[2] == reply_bytes(*request.read, request.count) && bytes.size() >= length ? length
                                                                                         : 0;
}

// Returns whether the stream begins with a TCP frame that carries a value for `request`.
bool tcp_answers(Bytes stream, const Request& request, std::uint16_t number) {
  if (stream.size() < 9 || word(stream, 0) != number || word(stream, 2) != 0) return false;
  const std::size_t length = answer_length(stream.subspan(6), request);
  return length > 0 && word(stream, 4) == length;
}

std::uint16_t crc(Bytes bytes) {
  unsigned value = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    value ^= byte;
    for (int bit = 0; bit < 8; ++bit)
      value = (value & 1U) != 0 ? (value >> 1) ^ 0xA001U : value >> 1;
  }
  return static_cast<std::uint16_t>(value);
}

// The same for a serial line, at the start of the stream.
bool rtu_answers_here(Bytes stream, const Request& request) {
  const std::size_t length = answer_length(stream, request);
  if (length == 0 || stream.size() < length + 2) return false;
  const std::uint16_t sum = crc(stream.first(length));
  return stream[length] == (sum & 0xFF) && stream[length + 1] == sum >> 8;
}

// After up to four stray bytes.
bool rtu_answers_behind_stray(Bytes stream, const Request& request) {
  for (std::size_t stray = 0; stray <= 4 && stray <= stream.size(); ++stray) {
    if (rtu_answers_here(stream.subspan(stray), request)) return true;
  }
  return false;
}

// If the stream starts with the request itself, this is an echo, unless it is the reply to a write
// of one register.
bool rtu_answers(Bytes stream, const Request& request) {
  std::vector<std::uint8_t> echo(request.view().begin(), request.view().end());
  const std::uint16_t sum = crc(echo);
  echo.push_back(static_cast<std::uint8_t>(sum & 0xFF));
  echo.push_back(static_cast<std::uint8_t>(sum >> 8));
  for (std::size_t at = 0; at <= 4 && at + echo.size() <= stream.size(); ++at) {
    if (std::equal(echo.begin(), echo.end(), stream.begin() + static_cast<long>(at)) &&
        rtu_answers_behind_stray(stream.subspan(at + echo.size()), request)) {
      return true;
    }
  }
  return rtu_answers_behind_stray(stream, request);
}

Request make_request(std::uint8_t kind, std::uint8_t unit) {
  const std::array<std::uint16_t, 2> values{0x1234, 0x5678};
  switch (kind % 6) {
    case 0: return read_request(unit, ReadFunction::input_registers, 100, 2);
    case 1: return read_request(unit, ReadFunction::holding_registers, 0, 1);
    case 2: return read_request(unit, ReadFunction::input_registers, 7, 64);
    case 3: return write_request(unit, WriteFunction::single, 10, values);
    case 4: return read_request(unit, ReadFunction::coils, 3, 9);
    default: return write_request(unit, WriteFunction::multiple, 10, values);
  }
}

void check_rejected(Outcome outcome, const Reply& reply) {
  if (outcome != Outcome::valid && reply.count != 0) fail("registers of a reply that is no answer");
}

void fuzz_tcp(const Request& request, Bytes stream, bool stay_open, bool twice) {
  LinkSettings settings;
  settings.response_timeout_ms = 10;
  static BusWaiter waiter;
  std::array<int, 2> sockets{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, sockets.data()) != 0) {
    fail("no socket pair");
  }
  ModbusTransport transport(settings, waiter);
  if (!transport.adopt(sockets[0])) fail("socket not taken");
  // The reply is sent before the request. libmodbus accepts this, and it saves time.
  if (::write(sockets[1], stream.data(), stream.size()) != static_cast<ssize_t>(stream.size())) {
    fail("write");
  }
  if (!stay_open) ::shutdown(sockets[1], SHUT_WR);  // a short reply is detected without a time-out

  Reply reply;
  const Outcome first = transport.exchange(request, reply, ModbusTransport::Settle::full);
  if ((first == Outcome::valid) != tcp_answers(stream, request, 1)) fail("first reply misjudged");
  check_rejected(first, reply);
  if (first != Outcome::valid && first != Outcome::exception && transport.connected()) {
    fail("connection kept after a failure");
  }
  if (twice && transport.connected()) {
    // The remaining stream must not answer the next request unless it is valid for that one.
    const std::size_t used = std::min(6 + word(stream, 4), stream.size());
    const Outcome second = transport.exchange(request, reply, ModbusTransport::Settle::full);
    if ((second == Outcome::valid) != tcp_answers(stream.subspan(used), request, 2)) {
      fail("second reply misjudged");
    }
    check_rejected(second, reply);
  }
  ::close(sockets[1]);
}

struct Line {
  Line() {
    std::array<char, 64> path{};
    if (::openpty(&device_end, &line, path.data(), nullptr, nullptr) != 0) fail("no terminal");
    ::fcntl(device_end, F_SETFL, O_NONBLOCK);
    settings.transport = Transport::rtu;
    settings.device = path.data();
    settings.baud = 115200;
    settings.response_timeout_ms = 2;
  }
  int device_end = -1;
  int line = -1;  // stays open, so that the line outlives each transport
  LinkSettings settings;
};

void fuzz_rtu(const Request& request, Bytes stream) {
  static BusWaiter waiter;
  static const Line line;
  ModbusTransport transport(line.settings, waiter);
  if (!transport.connect()) fail("line not open");
  ::tcflush(line.line, TCIOFLUSH);
  if (!stream.empty() && ::write(line.device_end, stream.data(), stream.size()) !=
                             static_cast<ssize_t>(stream.size())) {
    fail("write");
  }
  Reply reply;
  const Outcome outcome = transport.exchange(request, reply, ModbusTransport::Settle::brief);
  if (outcome == Outcome::valid && !rtu_answers(stream, request)) fail("serial reply misjudged");
  check_rejected(outcome, reply);
  if (outcome == Outcome::invalid && transport.connected() && transport.discard_unasked() != 0) {
    fail("bytes left on the line after a failure");
  }
}

}  // namespace

// First byte: kind of request. Second byte: bit 0 puts the right frame around the bytes. Bit 1
// keeps the connection open after them. Bit 2 asks twice. Bit 3 uses a serial line instead of TCP.
// On it, bits 4 and 5 put an echo and up to three stray bytes (bits 6 and 7) before them. The
// device sends the other bytes.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::uint8_t unit = 1;
  const Request request = make_request(data[0], unit);
  const bool framed = (data[1] & 1) != 0;
  const bool serial = (data[1] & 8) != 0;
  const Bytes sent(data + 2, std::min<std::size_t>(size - 2, 600));

  std::vector<std::uint8_t> stream;
  if (framed && !serial) {
    const std::size_t body = sent.size() + 1;
    stream = {
        0, 1, 0, 0, static_cast<std::uint8_t>(body >> 8), static_cast<std::uint8_t>(body & 0xFF)};
  }
  if (framed) stream.push_back(unit);
  stream.insert(stream.end(), sent.begin(), sent.end());
  if (framed && serial) {
    const std::uint16_t sum = crc(stream);
    stream.push_back(static_cast<std::uint8_t>(sum & 0xFF));
    stream.push_back(static_cast<std::uint8_t>(sum >> 8));
  }
  if (serial && (data[1] & 16) != 0) {
    std::vector<std::uint8_t> before(data[1] >> 6, 0);
    if ((data[1] & 32) != 0) {
      const RtuFrame echo = rtu_frame(request);
      before.insert(before.begin(), echo.view().begin(), echo.view().end());
    }
    stream.insert(stream.begin(), before.begin(), before.end());
  }
  if (serial) {
    fuzz_rtu(request, stream);
  } else {
    fuzz_tcp(request, stream, (data[1] & 2) != 0, (data[1] & 4) != 0);
  }
  return 0;
}
