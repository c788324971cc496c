// SPDX-License-Identifier: Apache-2.0
// What a Modbus link, a point on it and a loop's wiring consist of. Plain data: read from YAML by
// config/, used by the classes of this folder. Ranges are stated here and checked by config/.
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

  // TCP. A numeric IPv4 or IPv6 address or "localhost": names are not looked up, since a name
  // server that does not answer would stall the bus thread.
  std::string host;
  std::uint16_t port = 502;       // 1..65535
  int connect_timeout_ms = 1000;  // 50..10000
  // Connections, 1..4, that the units of a gateway share. Not set: each unit has one of its own.
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
  // Where units share a line or a connection: how often a unit that does not answer is asked again, 0.5..600 s. Each attempt
  // delays the others by one response timeout.
  double probe_interval_s = 5.0;

  bool operator==(const LinkSettings&) const = default;
};

constexpr int response_timeout_ms(const LinkSettings& link) noexcept {
  return link.response_timeout_ms.value_or(link.transport == Transport::tcp ? 300 : 500);
}

// The tables of bits are for what is only read.
enum class Table : std::uint8_t { input_register, holding_register, coil, discrete_input };
constexpr bool is_bit(Table table) noexcept {
  return table == Table::coil || table == Table::discrete_input;
}
enum class RegisterType : std::uint8_t { u16, i16, u32, i32, f32, f64 };
// Registers that a value of this type takes.
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
// The bytes of a number as they appear on the wire: abcd is most significant first. For f64 the
// words are turned round as a whole: cdab is GHEFCDAB, badc BADCFEHG, dcba HGFEDCBA.
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

// A register of the device that tells whether the point beside it can be trusted: good while
// (register & mask) == value.
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
  // How long a unit may be silent, or its connection lost, before the value is bad and the command
  // lost. 0: they are at once, when the unit counts as silent.
  std::int64_t max_age_ns = 0;

  friend bool operator==(const PointSettings&, const PointSettings&) = default;
};

// What drives the valve home when no command reaches the positioner any more: only the device can.
enum class CommLossProtection : std::uint8_t {
  watchdog_register,  // a register of the device, written here at every connect
  set_by_device,      // configured on the device itself
  none_accepted       // there is none, and the integrator has said so
};

struct WatchdogRegister {
  PointSettings point;  // a holding register
  double value = 0.0;   // engineering units of that register, written before the first command
  // How often the register is read to see whether the device still has it: on a serial line a
  // restart between two polls shows nowhere else. 1..3600 s.
  double check_interval_s = 10.0;

  friend bool operator==(const WatchdogRegister&, const WatchdogRegister&) = default;
};

struct CommLossSettings {
  CommLossProtection protection = CommLossProtection::none_accepted;
  std::optional<WatchdogRegister> watchdog;  // set exactly for watchdog_register
  // After which the device acts, 0.1..3600 s; longer than two poll periods plus two response
  // timeouts, or a single lost reply trips it. Not used for none_accepted.
  double timeout_s = 0.0;

  friend bool operator==(const CommLossSettings&, const CommLossSettings&) = default;
};

// What the positioner makes of a command.
struct OutputStage {
  double low = 0.0;     // CO units; the device or this backend goes no lower
  double high = 100.0;  // CO units; above low
  // Step of the device's converter, CO units; 0: none coarser than the register itself.
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
  // A command older than this is not written any more, so that the device's watchdog acts when the
  // loop hangs. Longer than the loop's own period. Not set: three poll periods and 100 ms.
  std::optional<std::int64_t> max_command_age_ns;

  friend bool operator==(const LoopModbusSettings&, const LoopModbusSettings&) = default;
};

// A value of a loop that another controller runs; each may be on a device of its own.
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

// So long without a confirmed command, and the output counts as lost: the device's own watchdog may
// move the valve before the next one reaches it. Where there is none, the valve only stays behind.
constexpr std::int64_t longest_silence_ns(const LoopModbusSettings& loop) noexcept {
  const std::int64_t reply_ns = response_timeout_ms(loop.positioner_link) * std::int64_t{1'000'000};
  const bool watched = loop.comm_loss.protection != CommLossProtection::none_accepted;
  if (!watched) return max_command_age_ns(loop) + 2 * reply_ns;
  const auto timeout_ns = static_cast<std::int64_t>(loop.comm_loss.timeout_s * 1e9);
  const std::int64_t next_ns = loop.poll_period_ns + reply_ns;  // until the next one is confirmed
  return std::max(timeout_ns - next_ns, next_ns);
}

}  // namespace loopwarden::hal::modbus
