// SPDX-License-Identifier: Apache-2.0
// Settings of a loop on 4-20 mA and digital lines. Plain data: config/ reads it from YAML and
// checks the ranges stated here. The classes of this folder use it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace loopwarden::hal::iio {

inline constexpr double kLiveZero = 4.0;  // mA at the low end of a range

// Limits of NAMUR NE 43, mA, in rising order. Vendors differ, so each can be set.
struct Ne43Limits {
  double failure_low = 3.6;    // below: the transmitter reports a failure
  double measure_low = 3.8;    // below: neither failure nor measurement
  double measure_high = 20.5;  // above: neither failure nor measurement
  double failure_high = 21.0;  // above: the transmitter reports a failure

  bool operator==(const Ne43Limits&) const = default;
};

struct Ne43Settings {
  Ne43Limits limits;
  int entry_samples = 3;    // 1..100 consecutive failure currents before the sample becomes bad
  double recovery_s = 2.0;  // 0..60 s continuously inside the measuring range before bad is left

  bool operator==(const Ne43Settings&) const = default;
};

// A channel of an IIO device. The device is found by the text in its `name` or `label` file,
// because numbers such as iio:device0 change from boot to boot.
struct ChannelSettings {
  std::string device;
  std::string channel;  // as in the file names: "voltage0", "current1"
  // Physical unit of (raw + offset) * scale for 1 mA: 1 for a current channel (mA), the shunt in
  // ohm for a voltage channel (mV).
  double units_per_ma = 1.0;  // > 0
  // For drivers without these files. Values set here replace those of the files.
  std::optional<double> scale;   // finite, not 0
  std::optional<double> offset;  // raw units

  bool operator==(const ChannelSettings&) const = default;
};

struct AnalogInputSettings {
  ChannelSettings channel;
  double low = 0.0;     // engineering units at 4 mA
  double high = 100.0;  // engineering units at 20 mA; not equal to low
  Ne43Settings ne43;

  bool operator==(const AnalogInputSettings&) const = default;
};

struct AnalogOutputSettings {
  ChannelSettings channel;
  double low = 0.0;                 // CO units at 4 mA
  double high = 100.0;              // CO units at 20 mA; not equal to low
  double lowest_ma = 3.8;           // mA, limits of the output; 0..22
  double highest_ma = 20.5;         // mA
  std::int64_t lowest_raw = 0;      // of the converter, which refuses values outside
  std::int64_t highest_raw = 4095;  // above lowest_raw
  // A converter on the same board has no device watchdog. If commands stop, the I/O thread itself
  // outputs this current. Not set: the last output stays.
  std::optional<double> safe_ma;  // 0..22; may be outside the limits above, to signal failure

  bool operator==(const AnalogOutputSettings&) const = default;
};

// A line of a GPIO chip.
struct LineSettings {
  std::string chip;  // "/dev/gpiochip0", "gpiochip0" or a label; empty: any chip with the line
  std::string line;  // name of the line, or its number on the chip
  bool active_low = false;

  bool operator==(const LineSettings&) const = default;
};

struct EnableSettings {
  LineSettings line;         // active: closed, control permitted
  double debounce_s = 0.05;  // 0..5 s without a change before the new state counts

  bool operator==(const EnableSettings&) const = default;
};

struct AliveSettings {
  LineSettings line;
  double half_period_s = 0.5;  // 0.01..60 s between two edges

  bool operator==(const AliveSettings&) const = default;
};

struct AnalogSettings {
  std::string iio_root = "/sys/bus/iio/devices";
  AnalogInputSettings process_variable;          // PV units
  std::optional<AnalogInputSettings> read_back;  // valve position, CO units
  AnalogOutputSettings output;
  std::optional<EnableSettings> enable;
  std::optional<LineSettings> alarm_relay;  // active: relay energised, no alarm
  std::optional<AliveSettings> alive;
  std::int64_t poll_period_ns = 100'000'000;  // 1 ms..60 s
  // A command older than this is no longer output; the safe output replaces it. Not set: three poll
  // periods and 100 ms.
  std::optional<std::int64_t> max_command_age_ns;

  bool operator==(const AnalogSettings&) const = default;
};

constexpr std::int64_t max_command_age_ns(const AnalogSettings& loop) noexcept {
  return loop.max_command_age_ns.value_or(3 * loop.poll_period_ns + 100'000'000);
}

}  // namespace loopwarden::hal::iio
