// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <modbus/modbus.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "hal/modbus/bus_waiter.hpp"
#include "hal/modbus/modbus_settings.hpp"
#include "hal/modbus/pdu.hpp"

namespace loopwarden::hal::modbus {

enum class Outcome : std::uint8_t {
  valid,
  exception,     // the device answered with an error
  timeout,       // no reply in time
  invalid,       // a reply that does not answer the request
  disconnected,  // the connection broke or did not exist
  stopped        // the bus thread must end
};

// A connection with one request at a time. libmodbus opens the line and receives on TCP. Its error
// recovery is off, because it blocks and repeats requests. rtu_frame.hpp finds replies on a serial
// line and ignores an echo and stray bytes.
//
// After any result except a valid reply or an exception, a late byte must not meet the next
// request. TCP is therefore closed. RTU input is read and discarded until the line is silent. Bus
// thread only.
class ModbusTransport {
 public:
  ModbusTransport(LinkSettings settings, BusWaiter& waiter);
  ModbusTransport(const ModbusTransport&) = delete;
  ModbusTransport& operator=(const ModbusTransport&) = delete;
  ~ModbusTransport();

  bool connect();
  // Takes over a connected stream socket (TCP framing).
  bool adopt(int socket);
  void disconnect() noexcept;
  bool connected() const noexcept { return file_ >= 0; }
  // Returns the reason why the last connect() or exchange() failed, with its unit.
  const std::string& error() const noexcept { return error_; }
  // Returns the number of replies, including exceptions, on the present or the last connection.
  std::size_t replies() const noexcept { return replies_; }
  // Returns whether the device ended the last connection.
  bool closed_by_device() const noexcept { return closed_by_device_; }

  // Silence of the line that is required after a failure. `full`: as long as the response timeout.
  // `brief`: 3.5 characters, for a unit from which no late reply is expected.
  enum class Settle : std::uint8_t { full, brief };
  Outcome exchange(const Request& request, Reply& reply, Settle settle);

  // Discards unrequested bytes and returns their number. On TCP they close the connection. On a
  // serial line fewer bytes than a reply has count as stray, and the result is 0.
  std::size_t discard_unasked();
  // Returns the number of bytes discarded after the last exchange.
  std::size_t drained_bytes() const noexcept { return drained_bytes_; }

  // Serial line: bytes received in addition to replies since the last call.
  struct Oddities {
    bool echo = false;            // requests were echoed
    std::size_t stray_bytes = 0;  // before or after the newest reply
  };
  Oddities take_oddities() noexcept { return std::exchange(oddities_, {}); }

 private:
  struct ModbusDeleter {
    void operator()(modbus_t* context) const noexcept { modbus_free(context); }
  };

  bool connect_tcp();
  bool connect_rtu();
  bool fail(std::string why);
  bool keep_pause();  // waits between a transfer and the next request; false if the thread must end
  bool send(const Request& request);
  Outcome receive(const Request& request, Reply& reply);
  Outcome receive_tcp(const Request& request, Reply& reply, std::int64_t deadline_ns);
  Outcome receive_rtu(const Request& request, Reply& reply, std::int64_t deadline_ns);
  Outcome judge(const Request& request, std::span<const std::uint8_t> bytes, Reply& reply);
  Outcome no_reply(const Request& request, std::string why);
  void settle_line(std::int64_t silence_ns);
  std::int64_t character_ns() const noexcept;
  // Returns the silence that ends a serial frame: 3.5 characters, or the fixed time of the
  // specification for fast lines.
  std::int64_t frame_gap_ns() const noexcept;

  const LinkSettings settings_;
  BusWaiter& waiter_;
  std::unique_ptr<modbus_t, ModbusDeleter> context_;
  int file_ = -1;
  std::uint16_t transaction_ = 0;   // TCP's number of the request
  std::int64_t quiet_from_ns_ = 0;  // end of the last transfer
  std::size_t drained_bytes_ = 0;
  std::size_t replies_ = 0;
  bool closed_by_device_ = false;
  bool echoes_ = false;            // serial line: the newest read was echoed before its reply
  std::size_t surplus_bytes_ = 0;  // received together with the newest reply, after it
  Oddities oddities_;
  std::string error_;
};

}  // namespace loopwarden::hal::modbus
