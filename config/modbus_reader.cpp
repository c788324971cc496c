// SPDX-License-Identifier: Apache-2.0
#include "config/modbus_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "config/byte_orders.hpp"
#include "config/watched_io_reader.hpp"

namespace loopwarden::config {
namespace {

using hal::modbus::ByteOrder;
using hal::modbus::LinkSettings;
using hal::modbus::LoopModbusSettings;
using hal::modbus::PointSettings;
using hal::modbus::RegisterSpec;
using hal::modbus::RegisterType;
using hal::modbus::StatusRegister;
using hal::modbus::Table;
using hal::modbus::Transport;
using hal::modbus::WriteFunction;

constexpr auto kTables = std::to_array<Choice<Table>>(
    {{"input", Table::input_register}, {"holding", Table::holding_register}});
constexpr auto kModeTables = std::to_array<Choice<Table>>({{"input", Table::input_register},
                                                           {"holding", Table::holding_register},
                                                           {"coil", Table::coil},
                                                           {"discrete", Table::discrete_input}});
constexpr auto kHoldingOnly = std::to_array<Choice<Table>>({{"holding", Table::holding_register}});
constexpr auto kTypes = std::to_array<Choice<RegisterType>>({{"u16", RegisterType::u16},
                                                             {"i16", RegisterType::i16},
                                                             {"u32", RegisterType::u32},
                                                             {"i32", RegisterType::i32},
                                                             {"f32", RegisterType::f32},
                                                             {"f64", RegisterType::f64}});
constexpr auto kWriteFunctions = std::to_array<Choice<WriteFunction>>(
    {{"multiple", WriteFunction::multiple}, {"single", WriteFunction::single}});

constexpr std::int64_t kLastAddress = 65535;
constexpr const char* kAddress = "0-based, as on the wire: 40001 in a manual is holding address 0";
constexpr const char* kCommLoss =
    "{timeout, register, value}, {timeout, set_by: device} or none_accepted";

bool is_whole_number(RegisterType type) { return type < RegisterType::f32; }

// Returns the range that the register type can hold.
std::pair<double, double> raw_range(RegisterType type) {
  const auto limits = []<class T>(T) {
    return std::pair{static_cast<double>(std::numeric_limits<T>::lowest()),
                     static_cast<double>(std::numeric_limits<T>::max())};
  };
  switch (type) {
    case RegisterType::u16: return limits(std::uint16_t{});
    case RegisterType::i16: return limits(std::int16_t{});
    case RegisterType::u32: return limits(std::uint32_t{});
    case RegisterType::i32: return limits(std::int32_t{});
    case RegisterType::f32: return limits(float{});
    case RegisterType::f64: break;
  }
  return limits(double{});
}

enum class Use { read, read_mode, write };

// Type names of other systems. They are refused, because an int or a word differs between systems.
constexpr auto kOtherTypes = std::to_array<OtherWord>(
    {{"uint16", "u16"}, {"uint", "u16"},  {"word", "u16"},   {"ushort", "u16"}, {"int16", "i16"},
     {"int", "i16"},    {"short", "i16"}, {"uint32", "u32"}, {"udint", "u32"},  {"dword", "u32"},
     {"ulong", "u32"},  {"int32", "i32"}, {"dint", "i32"},   {"long", "i32"},   {"float32", "f32"},
     {"float", "f32"},  {"real", "f32"},  {"single", "f32"}, {"real32", "f32"}, {"float64", "f64"},
     {"double", "f64"}, {"lreal", "f64"}, {"real64", "f64"}});

// Meaning of a register number in a device's manual: 40201, 400201 and 4x0201 are holding register
// 200 counted from 0, 30011 is input register 10.
struct ManualNumber {
  bool holding = false;
  std::int64_t address = 0;
};

std::optional<ManualNumber> manual_number(std::string_view text) {
  if (text.empty() || (text.front() != '3' && text.front() != '4')) return std::nullopt;
  const bool holding = text.front() == '4';
  const bool marked = text.size() > 2 && (text[1] == 'x' || text[1] == 'X');
  const std::string_view digits = text.substr(marked ? 2 : 1);
  if (!marked && digits.size() != 4 && digits.size() != 5) return std::nullopt;
  std::int64_t number = 0;
  const auto parsed = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (parsed.ec != std::errc() || parsed.ptr != digits.data() + digits.size()) return std::nullopt;
  if (number < 1 || number > kLastAddress + 1) return std::nullopt;
  return ManualNumber{holding, number - 1};
}

template <Use use>
std::string advice_on_address(std::string_view text) {
  const std::optional<ManualNumber> number = manual_number(text);
  if (!number) return {};
  const char* const table = number->holding ? "holding" : "input";
  const std::string is =
      fmt::format("{} is {} register {} counted from 0", text, table, number->address);
  if (use == Use::write && !number->holding) return is + ", which can't be written";
  return fmt::format("{}: write `table: {}`, `address: {}`", is, table, number->address);
}

template <Use use>
Value<std::int64_t> read_address(MapReader& in) {
  Value<std::int64_t> address = in.need_integer("address", {.high = kLastAddress,
                                                            .meaning = kAddress,
                                                            .hexadecimal = true,
                                                            .advice = advice_on_address<use>});
  // Devices with such high addresses exist, so a decimal number is accepted with a warning. Manuals
  // don't print these numbers in hexadecimal, so hexadecimal addresses get no warning.
  if (!address.given || !address.valid) return address;
  const std::string advice = advice_on_address<use>(in.word("address"));
  if (!advice.empty()) {
    in.warning("address", fmt::format("is used as written, but looks like a number from a manual. "
                                      "{}. If {} counted from 0 is meant, write 0x{:04X}",
                                      advice, address.value, address.value));
  }
  return address;
}

struct Register {
  RegisterSpec spec;
  Value<std::pair<double, double>> eu;  // engineering values that the device states, if given
};

// Reads scale and offset, or raw and eu.
void read_scaling(MapReader& in, const char* unit, const Value<RegisterType>& type, Register& reg) {
  RegisterSpec& spec = reg.spec;
  const Value<double> scale = in.number(
      "scale", {"", any_number(), "engineering value = raw * scale + offset; not 0"}, spec.scale);
  const Value<double> offset = in.number("offset", {"", any_number(), "see scale"}, spec.offset);
  const Value<std::pair<double, double>> raw =
      in.maybe_range("raw", {"", any_number(), "two values of the register, such as [0, 27648]",
                             "with eu, instead of scale and offset"});
  reg.eu = in.maybe_range(
      "eu", {unit, any_number(), "engineering values at the two of raw; may fall", "with raw"},
      MapReader::Ends::differ);
  const Value<std::pair<double, double>>& eu = reg.eu;
  spec.scale = scale;
  spec.offset = offset;
  if (scale.valid && scale == 0.0) in.error("scale", "must not be 0");
  if (!raw.given && !eu.given) return;
  for (const Value<double>* other : {&scale, &offset}) {
    if (!other->given) continue;
    in.report().error(other->place, other->key,
                      fmt::format("conflicts with {} (at {}); give raw and eu, or scale and offset",
                                  raw.given ? "raw" : "eu", to_text((raw.given ? raw : eu).place)));
  }
  if (!raw.given) in.error("eu", "needs raw as well: the register's values at these two");
  if (!eu.given) in.error("raw", "needs eu as well: the engineering values at these two");
  if (!raw.given || !eu.given || !raw.valid || !eu.valid) return;
  const auto [raw_low, raw_high] = raw.value;
  if (type.valid) {
    const auto [lowest, highest] = raw_range(type);
    if (raw_low < lowest || raw_high > highest) {
      in.error("raw",
               fmt::format("must lie within {:.9g} to {:.9g}, which the type (at {}) holds "
                           "(got [{}, {}])",
                           lowest, highest, to_text(type.place), brief(raw_low), brief(raw_high)));
    }
  }
  spec.scale = (eu.value.second - eu.value.first) / (raw_high - raw_low);
  spec.offset = eu.value.first - raw_low * spec.scale;
  if (spec.scale == 0.0 || !std::isfinite(spec.scale) || !std::isfinite(spec.offset)) {
    in.error("eu", "and raw differ too much in size to be scaled");
    spec.scale = 1.0;
  }
}

template <Use use>
Register read_register(MapReader& in, const char* unit) {
  Register reg;
  RegisterSpec& spec = reg.spec;
  if (use == Use::write) {
    spec.table = in.one_of("table", kHoldingOnly, "only these can be written", spec.table);
  } else if (use == Use::read_mode) {
    spec.table = in.need_one_of("table", kModeTables, "which registers, or bits: 0 or 1");
  } else {
    spec.table = in.need_one_of("table", kTables, "which registers");
  }
  const Value<std::int64_t> address = read_address<use>(in);
  spec.address = static_cast<std::uint16_t>(address);
  if (is_bit(spec.table) && !in.describing()) return reg;
  const Value<RegisterType> type =
      in.need_one_of("type", kTypes, "type of the value in the registers", {.others = kOtherTypes});
  spec.type = type;
  const Value<ByteOrder> order =
      in.one_of("order", kByteOrders,
                "bytes as they appear on the wire, in either case; abcd: most significant first",
                spec.order, {.any_case = true});
  spec.order = order;
  read_scaling(in, unit, type, reg);
  const int count = register_count(spec.type);
  if (use == Use::write) {
    const Value<WriteFunction> function = in.one_of(
        "write_function", kWriteFunctions,
        "single: function 6, for one register; multiple: function 16", spec.write_function);
    spec.write_function = function;
    if (function == WriteFunction::single && count > 1) {
      in.error("write_function",
               fmt::format("single writes one register, the type (at {}) takes {}",
                           to_text(type.place), count));
    }
  }
  if (address.valid && type.valid && address + count - 1 > kLastAddress) {
    in.error("address", fmt::format("{} registers from {} on reach beyond {}", count, address.value,
                                    kLastAddress));
  }
  if (type.valid && order.valid && count == 1 && order != ByteOrder::abcd &&
      order != ByteOrder::badc) {
    in.error("order", fmt::format("must be abcd or badc (swapped bytes) for a type of one register "
                                  "(type at {})",
                                  to_text(type.place)));
  }
  return reg;
}

// Warns if the engineering range of the register does not cover the loop's range.
void check_eu(MapReader& in, const Register& reg, const char* what,
              const Value<std::pair<double, double>>& needed) {
  if (!reg.eu.given || !reg.eu.valid || !needed.valid) return;
  const auto [low, high] = std::minmax(reg.eu.value.first, reg.eu.value.second);
  if (low <= needed.value.first && high >= needed.value.second) return;
  in.report().warning(reg.eu.place, reg.eu.key,
                      fmt::format("does not cover the {} [{}, {}] (at {}), for which the register "
                                  "would have to go beyond raw",
                                  what, brief(needed.value.first), brief(needed.value.second),
                                  to_text(needed.place)));
}

std::optional<StatusRegister> read_status(MapReader& point, std::string_view key) {
  std::optional<MapReader> in = point.maybe_section(
      key, "register that shows whether the value is valid: (register & mask) == value");
  if (!in) return std::nullopt;
  StatusRegister status;
  status.table = in->need_one_of("table", kTables, "which registers");
  const auto read = [&](const char* name, const char* meaning, std::int64_t fallback) {
    return static_cast<std::uint16_t>(
        in->integer(name, {0, 0xFFFF, "", meaning, true}, fallback).value);
  };
  status.address = static_cast<std::uint16_t>(read_address<Use::read>(*in));
  status.mask = read("mask", "relevant bits", status.mask);
  status.value = read("value", "value of these bits while the point is good", status.value);
  if ((status.value & ~status.mask) != 0) {
    in->error("value", fmt::format("has bits outside mask (at {}): it could never match",
                                   to_text(in->place("mask"))));
  }
  return status;
}

// Reads link and unit of a device. Returns null if the link does not exist.
const LinkSettings* read_device(MapReader& in, const IoContext& context, std::uint8_t& unit) {
  const Value<std::string> name = in.need_text("link", "name of a link in loopwardend.yaml");
  const Value<std::int64_t> number = in.need_integer(
      "unit", {0, 255, "", "unit identifier of the device; 1 to 247, over tcp also 0 and 255"});
  unit = static_cast<std::uint8_t>(number);
  if (!name.given || !name.valid || context.links == nullptr) return nullptr;
  const auto link = context.links->find(name);
  if (link == context.links->end()) {
    std::vector<std::string> names;
    for (const auto& [known, settings] : *context.links) names.push_back(known);
    in.error("link", fmt::format("no link '{}' in loopwardend.yaml{}", quotable(name.value),
                                 suggestion(name.value, names)));
    return nullptr;
  }
  if (context.link_uses != nullptr && number.given && number.valid) {
    context.link_uses->push_back({in.path("link"), name.place, name, unit});
  }
  const bool tcp_only = number == 0 || number > 247;
  const bool tcp_may = number == 0 || number == 255;
  if (number.valid && tcp_only && !(tcp_may && link->second.transport == Transport::tcp)) {
    in.error("unit", fmt::format("must be 1 to 247{} (got {})",
                                 link->second.transport == Transport::tcp ? ", 0 or 255" : "",
                                 number.value));
  }
  return &link->second;
}

// Reads a value to be read and its device. `wanted` is the range of `what`.
template <Use use>
void read_point(MapReader& in, const IoContext& context, hal::modbus::SourcePoint& read_from,
                const char* meaning, const char* unit, const char* what,
                const Value<std::pair<double, double>>& wanted) {
  PointSettings& point = read_from.point;
  const LinkSettings* link = read_device(in, context, point.unit);
  if (link != nullptr) read_from.link = *link;
  if (std::optional<MapReader> reg = in.need_section("register", meaning)) {
    const Register read = read_register<use>(*reg, unit);
    point.reg = read.spec;
    check_eu(*reg, read, what, wanted);
  }
  point.status = read_status(in, "status");
  point.max_age_ns = nanoseconds(context.max_age);
}

void read_transmitter(MapReader& in, const IoContext& context, LoopModbusSettings& settings) {
  hal::modbus::SourcePoint transmitter;
  read_point<Use::read>(in, context, transmitter, "holds PV, in PV units", "PV units",
                        "range of PV", context.pv_range);
  settings.transmitter_link = std::move(transmitter.link);
  settings.process_variable = transmitter.point;
}

// Checks that the command's register can represent all outputs of the loop.
void check_command(MapReader& in, const IoContext& context, const RegisterSpec& spec) {
  if (!context.output_range.valid || spec.scale == 0.0) return;
  const auto [raw_low, raw_high] = raw_range(spec.type);
  const double at_low = raw_low * spec.scale + spec.offset;
  const double at_high = raw_high * spec.scale + spec.offset;
  const auto [low, high] = context.output_range.value;
  const double step = is_whole_number(spec.type) ? std::abs(spec.scale) : 0.0;
  constexpr double kRounding = 0.5;        // of a step that the device rounds
  constexpr double kCoarsestShare = 0.01;  // of the output's span
  if (low < std::min(at_low, at_high) - kRounding * step ||
      high > std::max(at_low, at_high) + kRounding * step) {
    in.error("command",
             fmt::format("holds {:.6g} to {:.6g} CO units by its type and scale, which does not "
                         "cover the output range [{}, {}] (at {})",
                         std::min(at_low, at_high), std::max(at_low, at_high), brief(low),
                         brief(high), to_text(context.output_range.place)));
  } else if (step > kCoarsestShare * (high - low)) {
    in.warning("command", fmt::format("its steps of {} CO units are coarse for the output range "
                                      "[{}, {}] (at {})",
                                      brief(step), brief(low), brief(high),
                                      to_text(context.output_range.place)));
  }
}

void read_output_stage(MapReader& in, const IoContext& context, LoopModbusSettings& settings) {
  const Value<std::pair<double, double>> range = in.maybe_range(
      "range",
      {"CO units", any_number(), "range that the positioner accepts", "the output's range"});
  const std::pair<double, double> limits = range.given ? range.value : context.output_range.value;
  settings.output.low = limits.first;
  settings.output.high = limits.second;
  settings.output.resolution =
      in.number("resolution",
                {"CO units", at_least(0.0), "step of the positioner's converter; 0: unknown"}, 0.0);
}

hal::modbus::CommLossSettings read_protection(MapReader& in, const PointSettings& command,
                                              Value<double>& timeout) {
  hal::modbus::CommLossSettings settings;
  std::optional<hal::modbus::WatchdogRegister> watchdog;
  const CommLoss loss = read_comm_loss(in, kCommLoss, [&](MapReader& section) {
    hal::modbus::WatchdogRegister reg;
    reg.point.unit = command.unit;
    section.need_section(
        "register", "watchdog of the device, written at every connect",
        [&](MapReader& spec) { reg.point.reg = read_register<Use::write>(spec, "").spec; });
    reg.value = section.need_number("value", {"", any_number(), "value that is written to it"});
    watchdog = reg;
  });
  timeout = loss.timeout;
  if (!loss.device_acts) return settings;
  settings.timeout_s = loss.timeout;
  settings.watchdog = watchdog;
  settings.protection = watchdog ? hal::modbus::CommLossProtection::watchdog_register
                                 : hal::modbus::CommLossProtection::set_by_device;
  return settings;
}

void read_positioner(MapReader& in, const IoContext& context, LoopModbusSettings& settings,
                     IoSection& section, Value<double>& watchdog_timeout) {
  PointSettings& command = settings.command;
  command.max_age_ns = nanoseconds(context.max_age);
  const std::size_t errors_at_first = in.report().error_count();
  const LinkSettings* link = read_device(in, context, command.unit);
  if (link != nullptr) settings.positioner_link = *link;
  const std::size_t errors_before = in.report().error_count();
  if (std::optional<MapReader> reg =
          in.need_section("command", "register that takes CO, in CO units")) {
    section.command = reg->place();
    const Register written = read_register<Use::write>(*reg, "CO units");
    command.reg = written.spec;
    if (in.report().error_count() == errors_before) {
      check_command(in, context, command.reg);
      check_eu(*reg, written, "output range", context.output_range);
    }
    reg->close();  // an unknown key may be a misspelt scale
  }
  section.output_known = link != nullptr && in.report().error_count() == errors_at_first;
  if (std::optional<MapReader> reg =
          in.maybe_section("read_back", "register that holds the valve position, in CO units")) {
    PointSettings point;
    point.unit = command.unit;
    const Register read = read_register<Use::read>(*reg, "CO units");
    point.reg = read.spec;
    check_eu(*reg, read, "output range", context.output_range);
    point.status = read_status(*reg, "status");
    point.max_age_ns = command.max_age_ns;
    settings.read_back = point;
    section.has_read_back = true;
  }
  const std::size_t errors_before_stage = in.report().error_count();
  read_output_stage(in, context, settings);
  if (in.report().error_count() != errors_before_stage) section.output_known = false;
  section.output_resolution = settings.output.resolution;
  if (is_whole_number(command.reg.type)) {
    section.output_resolution = std::max(section.output_resolution, std::abs(command.reg.scale));
  }
  settings.comm_loss = read_protection(in, command, watchdog_timeout);
}

// Checks that the watchdog does not act during normal operation.
void check_timeout(MapReader& in, const Value<double>& timeout, const Value<double>& poll_period,
                   const LinkSettings& link) {
  if (!timeout.given || !timeout.valid || !poll_period.valid) return;
  const double response_s = hal::modbus::response_timeout_ms(link) / 1000.0;
  const double least = 2.0 * poll_period + 2.0 * response_s;
  if (timeout > least) return;
  in.report().error(
      timeout.place, timeout.key,
      fmt::format("must be longer than two poll periods of {} s and two response "
                  "timeouts of {} s, {} s, or one lost reply trips the watchdog "
                  "(got {})",
                  brief(poll_period), brief(response_s), brief(least), brief(timeout)));
}

}  // namespace

void read_modbus(MapReader in, const IoContext& context, IoSection& section) {
  LoopModbusSettings settings;
  const Value<double> poll_period = read_poll_period(in, context, between(0.01, 60.0));
  settings.poll_period_ns = nanoseconds(poll_period);
  settings.max_command_age_ns = read_max_command_age(in, context);
  in.need_section("transmitter", "source of PV", [&](MapReader& transmitter) {
    read_transmitter(transmitter, context, settings);
  });
  Value<double> watchdog_timeout;
  in.need_section("positioner", "destination of CO", [&](MapReader& positioner) {
    read_positioner(positioner, context, settings, section, watchdog_timeout);
  });
  check_timeout(in, watchdog_timeout, poll_period, settings.positioner_link);
  section.io = std::move(settings);
}

void read_modbus_source(MapReader in, const IoContext& context, IoSection& section) {
  using hal::modbus::SourcePoint;
  hal::modbus::ModbusSourceSettings settings;
  const Value<double> poll_period = read_poll_period(in, context, between(0.01, 60.0));
  settings.poll_period_ns = nanoseconds(poll_period);
  const auto read_pv = [&](MapReader& value, SourcePoint& point) {
    read_point<Use::read>(value, context, point, "holds it, in PV units", "PV units", "range of PV",
                          context.pv_range);
  };
  const auto read_output = [&](MapReader& value, SourcePoint& point) {
    read_point<Use::read>(value, context, point, "holds it, in CO units", "CO units",
                          "output range", context.output_range);
  };
  in.need_section("pv", kWatchedPv, [&](MapReader& pv) { read_pv(pv, settings.process_variable); });
  in.need_section("co", kWatchedCo, [&](MapReader& co) { read_output(co, settings.output); });
  in.maybe_section("sp", kWatchedSp,
                   [&](MapReader& sp) { read_pv(sp, settings.set_point.emplace()); });
  in.maybe_section("stem", kWatchedStem,
                   [&](MapReader& stem) { read_output(stem, settings.stem.emplace()); });
  in.maybe_section("mode", kWatchedMode, [&](MapReader& mode) {
    read_point<Use::read_mode>(mode, context, settings.mode.emplace(), "holds it", "", "", {});
    settings.mode_values = read_mode_values(mode, ModeForm::numbers);
  });
  section.io = std::move(settings);
}

}  // namespace loopwarden::config
