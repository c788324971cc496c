// SPDX-License-Identifier: Apache-2.0
// Serves the register map on a serial line as a Modbus RTU slave. libmodbus opens and sets up the
// line. This class separates the frames, for the reasons in modbus_answer.hpp.
//
// A frame ends with a silence of 3.5 characters (1.75 ms above 19200 baud). An ordinary thread
// under load or a USB adapter may see a silence that was not on the line. A frame shorter than its
// function requires therefore waits kLongestPause for the remaining bytes. Requests to other units,
// and their answers, are ignored. Unit 0 is a broadcast: executed, not answered.
//
// The gateway's thread serves it together with TCP. A lost line is opened again. A waiting answer
// (Reply::ready) is dropped when the master sends again, because the master would take it for the
// next answer.
//
// Limit: on an adapter that echoes, it can't distinguish its own bytes from a master's. Switch off
// the echo in the adapter.
//
// Source: MODBUS over Serial Line V1.02, section 2.5.1.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "daemon/gateway/modbus_answer.hpp"
#include "hal/modbus/modbus_settings.hpp"
#include "base/clock.hpp"

namespace loopwarden::daemon::gateway {

struct SerialServerSettings {
  hal::modbus::LinkSettings line;  // device, baud, parity, stop bits, RS-485
  std::uint8_t unit = 1;           // 1 to 247
  bool writes = false;             // whether masters on the line may write
};

struct SerialServerCounters {
  bool open = false;
  std::uint64_t requests = 0;   // to this unit, or to all
  std::uint64_t malformed = 0;  // received data without a valid frame
};

// Returns the size of the request in bytes, checksum included, from its first bytes; 0 if unknown
// yet, or invalid.
std::size_t serial_request_size(std::span<const std::uint8_t> frame) noexcept;
// Returns the CRC-16 of Modbus; its low byte is sent first.
std::uint16_t serial_checksum(std::span<const std::uint8_t> bytes) noexcept;

class SerialServer {
 public:
  using Answer = std::function<Reply(std::span<const std::uint8_t> request, const Peer& peer)>;

  // Does not throw if the line is missing: it may appear later.
  SerialServer(SerialServerSettings settings, base::Clock& clock, Answer answer);
  SerialServer(const SerialServer&) = delete;
  SerialServer& operator=(const SerialServer&) = delete;
  ~SerialServer();

  int fd() const noexcept { return fd_; }  // -1: not open
  // Returns how long the line may stay unserved while no byte arrives.
  std::chrono::milliseconds patience() const noexcept;
  // Handles the received bytes. Never blocks.
  void serve();

  const SerialServerCounters& counters() const noexcept { return counters_; }

 private:
  struct Line;
  void open(std::int64_t now_ns);
  void close_line(const std::string& why);
  bool receive(std::int64_t now_ns);
  void end_of_frame(std::int64_t silence_ns);
  void answer_frame(std::size_t size);
  void send_answer();
  std::int64_t gap_ns() const noexcept;

  static constexpr std::size_t kMostFrame = 256;
  SerialServerSettings settings_;
  base::Clock& clock_;
  Answer answer_;
  Peer peer_;
  std::unique_ptr<Line> line_;
  int fd_ = -1;
  std::int64_t retry_ns_ = 0;
  std::string reported_;
  std::array<std::uint8_t, kMostFrame> received_{};
  std::size_t size_ = 0;
  // received more bytes than a frame can have; ignored until the next silence
  bool overrun_ = false;
  std::int64_t last_byte_ns_ = 0;
  std::array<std::uint8_t, kMostFrame> to_send_{};
  std::size_t to_send_size_ = 0;
  std::function<bool()> ready_;  // condition of a waiting answer; empty: no answer waits
  SerialServerCounters counters_;
};

}  // namespace loopwarden::daemon::gateway
