// SPDX-License-Identifier: Apache-2.0
// Settings of a Modbus link, of a point on it and of a loop's wiring. Plain data: config/ reads it
// from YAML and checks the ranges stated here. The classes of this folder use it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

#include "hal/contract/loop_source.hpp"

namespace loopwarden::hal::modbus {

enum class Transport : std::uint8_t { tcp, rtu };
enum class Parity : std::uint8_t { none, even, odd };

struct LinkSettings {
  std::string name;  // for logs and status; not empty
  Transport transport = Transport::tcp;

  // TCP. A numeric IPv4 or IPv6 address or "localhost". Names are not resolved, because a name
  // server that does not answer would block the bus thread.
  std::string host;
  std::uint16_t port = 502;       // 1..65535
  int connect_timeout_ms = 1000;  // 50..10000
  // Number of connections, 1..4, that the units of a gateway share. Not set: each unit has its own.
  std::optional<int> connections;

  // RTU.
  std::string device;  // such as /dev/ttyUSB0 or /dev/serial/by-id/...
  int baud = 19200;    // 1200, 2400, 4800, 9600, 19200, 38400, 57600 or 115200
  Parity parity = Parity::even;
  int data_bits = 8;   // 7 or 8; RTU needs 8
  int stop_bits = 1;   // 1 or 2
  bool rs485 = false;  // let the kernel driver switch the transmitter (TIOCSRS485)

  // From the end of a request to the end of its reply, 10..10000 ms.
  // Not set: 300 (TCP) or 500 (RTU).
  std::optional<int> response_timeout_ms;
  // Silence between a reply and the next request, 0..1000 ms. RTU adds 3.5 characters by itself.
  int pause_ms = 0;
  // Wait before the next attempt after a failed one: doubles from min to max, +-20 % jitter.
  double reconnect_min_s = 0.5;   // 0.05..60
  double reconnect_max_s = 30.0;  // reconnect_min_s..600
  // For units that share a line or a connection: interval between requests to a unit that does not
  // answer, 0.5..600 s. Each attempt delays the others by one response timeout.
  double probe_interval_s = 5.0;

  bool operator==(const LinkSettings&) const = default;
};

constexpr int response_timeout_ms(const LinkSettings& link) noexcept {
  return link.response_timeout_ms.value_or(link.transport == Transport::tcp ? 300 : 500);
}

// The bit tables are only read.
enum class Table : std::uint8_t { input_register, holding_register, coil, discrete_input };
constexpr bool is_bit(Table table) noexcept {
  return table == Table::coil || table == Table::discrete_input;
}
enum class RegisterType : std::uint8_t { u16, i16, u32, i32, f32, f64 };
// Returns the number of registers of a value of this type.
constexpr std::uint16_t register_count(RegisterType type) noexcept {
  switch (type) {
    case RegisterType::u16:
    case RegisterType::i16: return 1;
    case RegisterType::u32:
    case RegisterType::i32:
    case RegisterType::f32: return 2;
    case RegisterType::f64: break;
  }
  return 4;
}
// Byte order of a number on the wire: abcd is most significant first. For f64 whole words are
// reordered: cdab is GHEFCDAB, badc BADCFEHG, dcba HGFEDCBA.
enum class ByteOrder : std::uint8_t { abcd, cdab, badc, dcba };
// Function 6 writes one register, 16 several. Types of more than one register need 16.
enum class WriteFunction : std::uint8_t { single, multiple };

struct RegisterSpec {
  Table table = Table::holding_register;
  std::uint16_t address = 0;  // 0-based, as on the wire; 0..65535 less the size of the type
  RegisterType type = RegisterType::u16;
  ByteOrder order = ByteOrder::abcd;  // 16-bit types: abcd, or badc for swapped bytes
  // Engineering value = raw * scale + offset. scale: finite, not 0. offset: finite.
  double scale = 1.0;
  double offset = 0.0;
  WriteFunction write_function = WriteFunction::multiple;

  friend bool operator==(const RegisterSpec&, const RegisterSpec&) = default;
};

// A status register of the device for the point: the value is good while (register & mask) ==
// value.
struct StatusRegister {
  Table table = Table::input_register;
  std::uint16_t address = 0;
  std::uint16_t mask = 0xFFFF;
  std::uint16_t value = 0;

  friend bool operator==(const StatusRegister&, const StatusRegister&) = default;
};

struct PointSettings {
  std::uint8_t unit = 1;  // 1..247; TCP also 0 and 255
  RegisterSpec reg;
  std::optional<StatusRegister> status;
  // Time that a unit may be silent, or its connection lost, before the value is bad and the command
  // lost. 0: as soon as the unit counts as silent.
  std::int64_t max_age_ns = 0;

  friend bool operator==(const PointSettings&, const PointSettings&) = default;
};

// Moves the valve to its safe position if commands no longer reach the positioner. Only the device
// itself can do this.
enum class CommLossProtection : std::uint8_t {
  watchdog_register,  // a register of the device, written at each connect
  set_by_device,      // configured on the device itself
  none_accepted       // not available, and accepted by the integrator
};

struct WatchdogRegister {
  PointSettings point;  // a holding register
  double value = 0.0;   // engineering units of that register, written before the first command
  // Interval of checks whether the register still has the value: on a serial line a restart between
  // two polls shows only there. 1..3600 s.
  double check_interval_s = 10.0;

  friend bool operator==(const WatchdogRegister&, const WatchdogRegister&) = default;
};

struct CommLossSettings {
  CommLossProtection protection = CommLossProtection::none_accepted;
  std::optional<WatchdogRegister> watchdog;  // set only with watchdog_register
  // Time until the device acts, 0.1..3600 s. It must be longer than two poll periods plus two
  // response timeouts, because otherwise one lost reply trips it. Not used for none_accepted.
  double timeout_s = 0.0;

  friend bool operator==(const CommLossSettings&, const CommLossSettings&) = default;
};

// Limits and resolution of the positioner's command.
struct OutputStage {
  double low = 0.0;     // CO units; lower limit of the device or of this backend
  double high = 100.0;  // CO units; above low
  // Step of the device's converter, CO units; 0: not coarser than the register.
  double resolution = 0.0;

  friend bool operator==(const OutputStage&, const OutputStage&) = default;
};

struct LoopModbusSettings {
  LinkSettings transmitter_link;
  PointSettings process_variable;          // PV units
  LinkSettings positioner_link;            // may be the same as transmitter_link
  PointSettings command;                   // CO units; a holding register
  std::optional<PointSettings> read_back;  // valve position, CO units, on positioner_link
  OutputStage output;
  CommLossSettings comm_loss;
  std::int64_t poll_period_ns = 100'000'000;  // 10 ms..60 s
  // A command older than this is not written, so that the device's watchdog acts if the loop hangs.
  // Must be longer than the loop's own period. Not set: three poll periods and 100 ms.
  std::optional<std::int64_t> max_command_age_ns;

  friend bool operator==(const LoopModbusSettings&, const LoopModbusSettings&) = default;
};

// A value of a loop that another controller runs. Each value may be on a different device.
struct SourcePoint {
  LinkSettings link;
  PointSettings point;

  friend bool operator==(const SourcePoint&, const SourcePoint&) = default;
};

struct ModbusSourceSettings {
  SourcePoint process_variable;  // PV units
  SourcePoint output;            // CO units
  std::optional<SourcePoint> set_point;
  std::optional<SourcePoint> stem;  // CO units
  std::optional<SourcePoint> mode;
  ModeValues mode_values;
  std::int64_t poll_period_ns = 1'000'000'000;  // 10 ms..60 s

  friend bool operator==(const ModbusSourceSettings&, const ModbusSourceSettings&) = default;
};

constexpr std::int64_t max_command_age_ns(const LoopModbusSettings& loop) noexcept {
  return loop.max_command_age_ns.value_or(3 * loop.poll_period_ns + 100'000'000);
}

// Returns the time without a confirmed command after which the output counts as lost. The device's
// own watchdog may move the valve before the next command arrives. Without a watchdog the valve
// only keeps an old position.
constexpr std::int64_t longest_silence_ns(const LoopModbusSettings& loop) noexcept {
  const std::int64_t reply_ns = response_timeout_ms(loop.positioner_link) * std::int64_t{1'000'000};
  const bool watched = loop.comm_loss.protection != CommLossProtection::none_accepted;
  if (!watched) return max_command_age_ns(loop) + 2 * reply_ns;
  const auto timeout_ns = static_cast<std::int64_t>(loop.comm_loss.timeout_s * 1e9);
  // until the next command is confirmed
  const std::int64_t next_ns = loop.poll_period_ns + reply_ns;
  return std::max(timeout_ns - next_ns, next_ns);
}

}  // namespace loopwarden::hal::modbus
