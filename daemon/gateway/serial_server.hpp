// SPDX-License-Identifier: Apache-2.0
// The register map on a serial line: a Modbus RTU slave. libmodbus opens and sets up the line; frames are
// told apart here, for the reasons in modbus_answer.hpp.
//
// A frame ends with a silence of 3.5 characters (1.75 ms above 19200 baud). An ordinary thread on a busy
// machine and a USB adapter see silences that were none: what is less than the request that it begins, by
// its function, waits kLongestPause for the rest. Requests to other units, and their answers, are let
// pass. Unit 0 is a broadcast: done, not answered.
//
// Served by the gateway's thread, together with TCP. A line that is gone is opened again. An answer that waits for
// something (Reply::ready) is given up when the master speaks again: it would be taken for the next one.
//
// What it can't do: tell its own bytes from a master's on an adapter that echoes; that has to be switched
// off in the adapter.
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
  bool writes = false;             // masters on the line may write
};

struct SerialServerCounters {
  bool open = false;
  std::uint64_t requests = 0;   // to this unit, or to all
  std::uint64_t malformed = 0;  // what was no frame
};

// Bytes that a request of this beginning has, checksum included; 0 if that can't be told yet, or never.
std::size_t serial_request_size(std::span<const std::uint8_t> frame) noexcept;
// CRC-16 as Modbus has it, low byte first on the wire.
std::uint16_t serial_checksum(std::span<const std::uint8_t> bytes) noexcept;

class SerialServer {
 public:
  using Answer = std::function<Reply(std::span<const std::uint8_t> request, const Peer& peer)>;

  // Does not throw for a line that is not there: it may come.
  SerialServer(SerialServerSettings settings, base::Clock& clock, Answer answer);
  SerialServer(const SerialServer&) = delete;
  SerialServer& operator=(const SerialServer&) = delete;
  ~SerialServer();

  int fd() const noexcept { return fd_; }  // -1: not open
  // How long this may be left alone when nothing comes.
  std::chrono::milliseconds patience() const noexcept;
  // Takes what is there; never blocks.
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
  bool overrun_ = false;  // more bytes than a frame can have, until the next silence
  std::int64_t last_byte_ns_ = 0;
  std::array<std::uint8_t, kMostFrame> to_send_{};
  std::size_t to_send_size_ = 0;
  std::function<bool()> ready_;  // of an answer that waits; empty: none
  SerialServerCounters counters_;
};

}  // namespace loopwarden::daemon::gateway
