// SPDX-License-Identifier: Apache-2.0
#include "services/net/sparkplug/payload.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>
#include <utility>

#include "base/text.hpp"
#include "sparkplug_b.pb.h"

namespace loopwarden::sparkplug {
namespace {

using Wire = wire::Payload;

constexpr std::uint32_t kMostType = 34;

int bits_of(DataType type) noexcept {
  switch (type) {
    case DataType::int8:
    case DataType::uint8: return 8;
    case DataType::int16:
    case DataType::uint16: return 16;
    case DataType::int32:
    case DataType::uint32: return 32;
    default: return 64;
  }
}

std::int64_t signed_of(std::uint64_t raw, int bits) noexcept {
  const int unused = 64 - bits;
  return static_cast<std::int64_t>(raw << unused) >> unused;
}

std::uint64_t unsigned_of(std::uint64_t raw, int bits) noexcept {
  return bits == 64 ? raw : raw & ((std::uint64_t{1} << bits) - 1);
}

// Returns whether `value` fits into `bits` bits of two's complement.
bool fits(std::int64_t value, int bits) noexcept {
  return signed_of(static_cast<std::uint64_t>(value), bits) == value;
}

// Returns whether the text is valid UTF-8 without zero bytes.
bool is_plain_utf8(std::string_view text) {
  return text.find('\0') == text.npos && base::is_utf8(text);
}

const std::string& checked(const std::string& text, const char* what) {
  if (!is_plain_utf8(text)) throw BadPayload(fmt::format("{} is not UTF-8 text", what));
  return text;
}

DataType checked_type(std::uint32_t type) {
  if (type > kMostType) throw BadPayload(fmt::format("there is no data type {}", type));
  return static_cast<DataType>(type);
}

// --- encoding; Out is a metric's or a property's message ---

template <class Out>
void put_integer(Out& out, std::uint64_t raw, int bits) {
  if (bits == 64) {
    out.set_long_value(raw);
  } else {
    out.set_int_value(static_cast<std::uint32_t>(raw));
  }
}

[[noreturn]] void misfit(DataType type) {
  throw std::logic_error(fmt::format("a value that is no {}", to_text(type)));
}

template <class Out>
void put_number(Out& out, DataType type, std::int64_t value) {
  if (type != DataType::unknown && (!is_signed(type) || !fits(value, bits_of(type)))) misfit(type);
  put_integer(out, static_cast<std::uint64_t>(value), bits_of(type));
}

template <class Out>
void put_number(Out& out, DataType type, std::uint64_t value) {
  const int bits = bits_of(type);
  if (type != DataType::unknown && (!is_unsigned(type) || unsigned_of(value, bits) != value)) {
    misfit(type);
  }
  put_integer(out, value, bits);
}

template <class Out>
void put_number(Out& out, DataType type, double value) {
  if (type == DataType::float32) {
    out.set_float_value(static_cast<float>(value));
  } else if (type == DataType::float64 || type == DataType::unknown) {
    out.set_double_value(value);
  } else {
    misfit(type);
  }
}

bool takes_bytes(DataType type) noexcept {
  return type == DataType::unknown || type == DataType::bytes || type == DataType::file ||
         type >= DataType::int8_array;
}

template <class Out>
void put_value(Out& out, DataType type, const Value& value) {
  const auto put = [&](const auto& v) {
    using T = std::decay_t<decltype(v)>;
    if constexpr (std::is_same_v<T, std::monostate>) {
      out.set_is_null(true);
    } else if constexpr (std::is_same_v<T, bool>) {
      if (type != DataType::boolean && type != DataType::unknown) misfit(type);
      out.set_boolean_value(v);
    } else if constexpr (std::is_same_v<T, std::string>) {
      if (!is_text(type) && type != DataType::unknown) misfit(type);
      out.set_string_value(v);
    } else if constexpr (std::is_same_v<T, Bytes>) {
      if constexpr (requires { out.set_bytes_value(v.data); }) {
        if (!takes_bytes(type)) misfit(type);
        out.set_bytes_value(v.data);
      } else {
        misfit(type);  // properties have no bytes
      }
    } else if constexpr (std::is_same_v<T, Opaque>) {
      misfit(type);
    } else {
      put_number(out, type, v);
    }
  };
  std::visit(put, value);
}

void put_metadata(Wire::MetaData& out, const MetaData& data) {
  if (data.multi_part) {
    out.set_is_multi_part(true);
    out.set_seq(data.part);
  }
  if (!data.content_type.empty()) out.set_content_type(data.content_type);
  if (data.size > 0) out.set_size(data.size);
  if (!data.file_name.empty()) out.set_file_name(data.file_name);
  if (!data.file_type.empty()) out.set_file_type(data.file_type);
  if (!data.md5.empty()) out.set_md5(data.md5);
  if (!data.description.empty()) out.set_description(data.description);
}

void put_metric(Wire::Metric& out, const Metric& metric, Types types) {
  if (!metric.name.empty()) out.set_name(metric.name);
  if (metric.alias) out.set_alias(*metric.alias);
  if (metric.time_ms) out.set_timestamp(*metric.time_ms);
  if (types == Types::sent && metric.type != DataType::unknown) {
    out.set_datatype(static_cast<std::uint32_t>(metric.type));
  }
  if (metric.historical) out.set_is_historical(true);
  if (metric.transient) out.set_is_transient(true);
  if (metric.metadata) put_metadata(*out.mutable_metadata(), *metric.metadata);
  for (const Property& property : metric.properties) {
    out.mutable_properties()->add_keys(property.key);
    Wire::PropertyValue& value = *out.mutable_properties()->add_values();
    value.set_type(static_cast<std::uint32_t>(property.type));
    put_value(value, property.type, property.value);
  }
  put_value(out, metric.type, metric.value);
}

// --- decoding ---

Value typed_integer(std::uint64_t raw, DataType type) {
  if (type == DataType::unknown) return raw;
  if (is_signed(type)) return signed_of(raw, bits_of(type));
  if (is_unsigned(type)) return unsigned_of(raw, bits_of(type));
  return Opaque{};
}

template <class In>
Value taken_value(const In& in, DataType type) {
  const auto if_type = [&](bool agrees, Value value) {
    return agrees || type == DataType::unknown ? std::move(value) : Value(Opaque{});
  };
  const bool floating = type == DataType::float32 || type == DataType::float64;
  if (in.is_null()) return std::monostate{};
  switch (in.value_case()) {
    case In::kIntValue: return typed_integer(in.int_value(), type);
    case In::kLongValue: return typed_integer(in.long_value(), type);
    case In::kFloatValue: return if_type(floating, static_cast<double>(in.float_value()));
    case In::kDoubleValue: return if_type(floating, in.double_value());
    case In::kBooleanValue: return if_type(type == DataType::boolean, in.boolean_value());
    case In::kStringValue: return if_type(is_text(type), checked(in.string_value(), "a value"));
    case In::VALUE_NOT_SET: return std::monostate{};
    default: break;
  }
  if constexpr (requires { in.bytes_value(); }) {
    if (in.has_bytes_value()) return if_type(takes_bytes(type), Bytes{in.bytes_value()});
  }
  return Opaque{};
}

MetaData taken_metadata(const Wire::MetaData& in) {
  return {.multi_part = in.is_multi_part(),
          .content_type = checked(in.content_type(), "a content type"),
          .size = in.size(),
          .part = in.seq(),
          .file_name = checked(in.file_name(), "a file's name"),
          .file_type = checked(in.file_type(), "a file's type"),
          .md5 = checked(in.md5(), "a check sum"),
          .description = checked(in.description(), "a description")};
}

std::vector<Property> taken_properties(const Wire::PropertySet& in) {
  if (in.keys_size() != in.values_size()) {
    throw BadPayload(
        fmt::format("a property set of {} keys and {} values", in.keys_size(), in.values_size()));
  }
  std::vector<Property> properties;
  properties.reserve(static_cast<std::size_t>(in.keys_size()));
  for (int i = 0; i < in.keys_size(); ++i) {
    const DataType type = checked_type(in.values(i).type());
    properties.push_back(
        {checked(in.keys(i), "a property's key"), type, taken_value(in.values(i), type)});
  }
  return properties;
}

Metric taken_metric(const Wire::Metric& in) {
  Metric metric;
  metric.name = checked(in.name(), "a metric's name");
  if (in.has_alias()) metric.alias = in.alias();
  if (in.has_timestamp()) metric.time_ms = in.timestamp();
  metric.type = checked_type(in.datatype());
  metric.historical = in.is_historical();
  metric.transient = in.is_transient();
  metric.value = taken_value(in, metric.type);
  if (in.has_metadata()) metric.metadata = taken_metadata(in.metadata());
  metric.properties = taken_properties(in.properties());
  return metric;
}

}  // namespace

const char* to_text(DataType type) noexcept {
  static constexpr std::array kNames{"Unknown",      "Int8",
                                     "Int16",        "Int32",
                                     "Int64",        "UInt8",
                                     "UInt16",       "UInt32",
                                     "UInt64",       "Float",
                                     "Double",       "Boolean",
                                     "String",       "DateTime",
                                     "Text",         "UUID",
                                     "DataSet",      "Bytes",
                                     "File",         "Template",
                                     "PropertySet",  "PropertySetList",
                                     "Int8Array",    "Int16Array",
                                     "Int32Array",   "Int64Array",
                                     "UInt8Array",   "UInt16Array",
                                     "UInt32Array",  "UInt64Array",
                                     "FloatArray",   "DoubleArray",
                                     "BooleanArray", "StringArray",
                                     "DateTimeArray"};
  static_assert(kNames.size() == kMostType + 1);
  const auto number = static_cast<std::size_t>(type);
  return number < kNames.size() ? kNames[number] : kNames[0];
}

bool is_signed(DataType type) noexcept { return type >= DataType::int8 && type <= DataType::int64; }

bool is_unsigned(DataType type) noexcept {
  return (type >= DataType::uint8 && type <= DataType::uint64) || type == DataType::date_time;
}

bool is_text(DataType type) noexcept {
  return type == DataType::string || type == DataType::text || type == DataType::uuid;
}

const Property* Metric::property(std::string_view key) const noexcept {
  const auto found = std::find_if(properties.begin(), properties.end(),
                                  [&](const Property& p) { return p.key == key; });
  return found == properties.end() ? nullptr : &*found;
}

const Metric* Payload::find(std::string_view name) const noexcept {
  const auto found =
      std::find_if(metrics.begin(), metrics.end(), [&](const Metric& m) { return m.name == name; });
  return found == metrics.end() ? nullptr : &*found;
}

std::string encode(const Payload& payload, Types types) {
  Wire out;
  if (payload.time_ms) out.set_timestamp(*payload.time_ms);
  if (payload.seq) out.set_seq(*payload.seq);
  for (const Metric& metric : payload.metrics) put_metric(*out.add_metrics(), metric, types);
  return out.SerializeAsString();
}

Payload decode(std::string_view bytes) {
  if (bytes.size() > kMostPayloadBytes) {
    throw BadPayload(fmt::format("{} bytes, at most {} are read", bytes.size(), kMostPayloadBytes));
  }
  Wire in;
  if (!in.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    throw BadPayload("not a Sparkplug B payload");
  }
  if (static_cast<std::size_t>(in.metrics_size()) > kMostMetrics) {
    throw BadPayload(
        fmt::format("{} metrics, at most {} are read", in.metrics_size(), kMostMetrics));
  }
  Payload payload;
  if (in.has_timestamp()) payload.time_ms = in.timestamp();
  if (in.has_seq()) payload.seq = in.seq();
  payload.metrics.reserve(static_cast<std::size_t>(in.metrics_size()));
  for (const Wire::Metric& metric : in.metrics()) payload.metrics.push_back(taken_metric(metric));
  return payload;
}

std::optional<double> number_of(const Value& value) noexcept {
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? 1.0 : 0.0;
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return static_cast<double>(*whole);
  if (const auto* count = std::get_if<std::uint64_t>(&value)) return static_cast<double>(*count);
  const auto* real = std::get_if<double>(&value);
  // A sensor without a reading may send NaN. It counts as null.
  return real != nullptr && std::isfinite(*real) ? std::optional(*real) : std::nullopt;
}

Value retyped(Value value, DataType type) {
  const auto* raw = std::get_if<std::uint64_t>(&value);
  return raw == nullptr ? std::move(value) : typed_integer(*raw, type);
}

}  // namespace loopwarden::sparkplug
