// SPDX-License-Identifier: Apache-2.0
#include "config/analog_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

namespace loopwarden::config {
namespace {

using hal::iio::AnalogSettings;

constexpr double kLowestMa = 0.0;
constexpr double kHighestMa = 22.0;
constexpr double kLiveZeroMa = 4.0;
constexpr double kSpanMa = 16.0;

// Returns the converter's numbers at 4 mA and at 20 mA, if they are stated.
Value<std::pair<double, double>> read_channel(MapReader& in, hal::iio::ChannelSettings& channel) {
  channel.device = in.need_text("device", "name or label of the IIO device");
  channel.channel = in.need_text("channel", "as in the file names: voltage0, current1");
  const Value<double> units_per_ma =
      in.number("units_per_ma",
                {"", above(0.0),
                 "of (raw + offset) * scale for 1 mA: 1 for a current channel "
                 "(mA), the shunt in ohm for a voltage channel (mV)"},
                channel.units_per_ma);
  channel.units_per_ma = units_per_ma;
  const Value<double> scale = in.maybe_number(
      "scale", {"", any_number(), "instead of the driver's; not 0", "the driver's"});
  const Value<double> offset = in.maybe_number(
      "offset", {"raw units", any_number(), "instead of the driver's", "the driver's"});
  if (scale.given && scale.valid && scale == 0.0) in.error("scale", "must not be 0");
  Value<std::pair<double, double>> raw = in.maybe_range(
      "raw", {"", any_number(), "the converter's numbers at 4 mA and at 20 mA, such as [0, 27648]",
              "instead of units_per_ma, scale and offset"});
  for (const Value<double>* other : {&units_per_ma, &scale, &offset}) {
    if (!raw.given || !other->given) continue;
    in.report().error(
        other->place, other->key,
        fmt::format("conflicts with raw (at {}); give only raw, or units_per_ma, scale and offset",
                    to_text(raw.place)));
  }
  if (scale.given) channel.scale = scale;
  if (offset.given) channel.offset = offset;
  if (raw.given && raw.valid) {
    channel.scale = kSpanMa / (raw.value.second - raw.value.first);
    channel.offset = kLiveZeroMa / *channel.scale - raw.value.first;
    if (*channel.scale == 0.0 || !std::isfinite(*channel.offset)) {
      in.error("raw", fmt::format("has a span that can't be scaled to {} mA", kSpanMa));
    }
  }
  return raw;
}

// Reads a range as [at 4 mA, at 20 mA].
std::pair<double, double> read_scale(MapReader& in, const char* unit,
                                     const Value<std::pair<double, double>>& fallback,
                                     const char* fallback_text) {
  const Value<std::pair<double, double>> range =
      in.maybe_range("range", {unit, any_number(), "at 4 mA and at 20 mA", fallback_text});
  return range.given ? range.value : fallback.value;
}

void read_ne43(MapReader& in, hal::iio::Ne43Settings& ne43) {
  std::optional<MapReader> section =
      in.maybe_section("ne43", "limits of failure currents (NAMUR NE 43), in rising order");
  if (!section) return;
  hal::iio::Ne43Limits& limits = ne43.limits;
  const auto read = [&](const char* key, const char* meaning, double& limit) {
    Value<double> value = section->number(key, {"mA", between(kLowestMa, 25.0), meaning}, limit);
    limit = value;
    return value;
  };
  const std::array<Value<double>, 4> values{
      read("failure_low", "below: failure", limits.failure_low),
      read("measure_low", "below: uncertain", limits.measure_low),
      read("measure_high", "above: uncertain", limits.measure_high),
      read("failure_high", "above: failure", limits.failure_high)};
  for (std::size_t i = 1; i < values.size(); ++i) {
    const Value<double>& below = values[i - 1];
    const Value<double>& above_it = values[i];
    if (!below.valid || !above_it.valid || below < above_it) continue;
    section->report().error(
        above_it.place, above_it.key,
        fmt::format("must be above {} = {} mA (got {})", below.key, brief(below), brief(above_it)));
  }
  section->set_integer("entry_samples",
                       {1, 100, "", "consecutive failure currents before PV becomes bad"},
                       ne43.entry_samples);
  section->set_number(
      "recovery",
      {"s", between(0.0, 60.0), "time inside the measuring range before PV is good again"},
      ne43.recovery_s);
}

hal::iio::LineSettings read_line(MapReader& in) {
  hal::iio::LineSettings line;
  const Value<std::string> chip =
      in.text("chip", "GPIO chip; default: any chip with the line", "any");
  if (chip.given) line.chip = chip;
  line.line = in.need_text("line", "name of the line, or its number on the chip");
  line.active_low = in.flag("active_low", "the line's low level is active", false);
  return line;
}

void read_output(MapReader& in, const IoContext& context, IoSection& section,
                 hal::iio::AnalogOutputSettings& output) {
  const std::size_t errors = in.report().error_count();
  section.command = in.place();
  const Value<std::pair<double, double>> raw = read_channel(in, output.channel);
  std::tie(output.low, output.high) =
      read_scale(in, "CO units", context.output_range, "the output's range");
  const Value<std::pair<double, double>> limits = in.maybe_range(
      "limits", {"mA", between(kLowestMa, kHighestMa), "of the output current", "[3.8, 20.5]"});
  if (limits.given) std::tie(output.lowest_ma, output.highest_ma) = limits.value;
  constexpr std::int64_t kLargestRaw = 1LL << 32;
  const Value<std::int64_t> lowest = in.integer(
      "lowest_raw", {-kLargestRaw, kLargestRaw, "", "of the converter"}, output.lowest_raw);
  const Value<std::int64_t> highest = in.integer(
      "highest_raw", {-kLargestRaw, kLargestRaw, "", "of the converter; above lowest_raw"},
      output.highest_raw);
  output.lowest_raw = lowest;
  output.highest_raw = highest;
  if (lowest.valid && highest.valid && lowest >= highest) {
    in.error("highest_raw",
             fmt::format("must be above lowest_raw = {} (got {})", lowest.value, highest.value));
  }
  if (raw.given && raw.valid && lowest.valid && highest.valid &&
      (raw.value.first < static_cast<double>(lowest.value) ||
       raw.value.second > static_cast<double>(highest.value))) {
    in.error("raw", fmt::format("must lie within lowest_raw = {} and highest_raw = {}, the range "
                                "that the converter accepts (got [{}, {}])",
                                lowest.value, highest.value, brief(raw.value.first),
                                brief(raw.value.second)));
  }
  in.maybe_number("safe_current",
                  {"mA", between(kLowestMa, kHighestMa),
                   "output of the I/O thread if commands stop", "the last output stays"},
                  output.safe_ma);
  section.output_known = in.report().error_count() == errors;
  // Both protections are set up outside: a watchdog relay on the alive line, or one in the output
  // module.
  read_comm_loss(in, "{timeout, set_by: device} or none_accepted", nullptr);
  const std::size_t errors_in_keys = in.report().error_count();
  in.close();  // an unknown key may be a misspelt scale
  if (in.report().error_count() != errors_in_keys) section.output_known = false;
  const double steps = raw.given && raw.valid
                           ? raw.value.second - raw.value.first
                           : static_cast<double>(output.highest_raw - output.lowest_raw);
  section.output_resolution = std::abs(output.high - output.low) / std::max(1.0, steps);
}

void read_lines(MapReader& in, AnalogSettings& settings) {
  if (std::optional<MapReader> enable = in.maybe_section(
          "enable",
          "contact that permits control. Not a safety function: an emergency stop must act "
          "in hardware")) {
    hal::iio::EnableSettings line;
    line.line = read_line(*enable);
    enable->set_number("debounce",
                       {"s", between(0.0, 5.0), "time without a change before a new state counts"},
                       line.debounce_s);
    settings.enable = line;
  }
  in.maybe_section("alarm_relay", "energised while no alarm is on",
                   [&](MapReader& relay) { settings.alarm_relay = read_line(relay); });
  if (std::optional<MapReader> alive =
          in.maybe_section("alive", "square wave while the loop runs, for an external watchdog")) {
    hal::iio::AliveSettings line;
    line.line = read_line(*alive);
    alive->set_number("half_period", {"s", between(0.01, 60.0), "between two edges"},
                      line.half_period_s);
    settings.alive = line;
  }
}

}  // namespace

void read_analog(MapReader in, const IoContext& context, IoSection& section) {
  AnalogSettings settings;
  settings.iio_root = in.text("iio_root", "where the IIO devices are", settings.iio_root);
  settings.poll_period_ns = nanoseconds(read_poll_period(in, context, between(0.001, 60.0)));
  settings.max_command_age_ns = read_max_command_age(in, context);
  if (std::optional<MapReader> input = in.need_section("input", "4-20 mA of the transmitter")) {
    hal::iio::AnalogInputSettings& pv = settings.process_variable;
    read_channel(*input, pv.channel);
    std::tie(pv.low, pv.high) = read_scale(*input, "PV units", context.pv_range, "PV's range");
    read_ne43(*input, pv.ne43);
  }
  if (std::optional<MapReader> input =
          in.maybe_section("read_back", "4-20 mA of the positioner's read-back")) {
    hal::iio::AnalogInputSettings read_back;
    read_channel(*input, read_back.channel);
    std::tie(read_back.low, read_back.high) =
        read_scale(*input, "CO units", context.output_range, "the output's range");
    read_ne43(*input, read_back.ne43);
    settings.read_back = read_back;
    section.has_read_back = true;
  }
  in.need_section("output", "4-20 mA to the positioner", [&](MapReader& output) {
    read_output(output, context, section, settings.output);
  });
  read_lines(in, settings);
  section.io = std::move(settings);
}

}  // namespace loopwarden::config
