// SPDX-License-Identifier: Apache-2.0
// A Sparkplug B payload as plain values, with encoding and decoding.
//
// A number has the type of its metric. Signed integers are std::int64_t, unsigned integers and
// dates std::uint64_t, floating-point numbers double, whatever their width. A message may leave out
// the type. DDATA does, because the birth has it. An integer is then std::uint64_t with the bits of
// the wire, until retyped() applies its type.
//
// Contents of data sets, templates and nested property sets are not kept: such a value is Opaque.
// Arrays are the Bytes of the wire.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace loopwarden::sparkplug {

// Numbers are those of the specification (6.4.16).
enum class DataType : std::uint8_t {
  unknown = 0,
  int8 = 1,
  int16 = 2,
  int32 = 3,
  int64 = 4,
  uint8 = 5,
  uint16 = 6,
  uint32 = 7,
  uint64 = 8,
  float32 = 9,
  float64 = 10,
  boolean = 11,
  string = 12,
  date_time = 13,
  text = 14,
  uuid = 15,
  data_set = 16,
  bytes = 17,
  file = 18,
  template_ = 19,
  property_set = 20,
  property_set_list = 21,
  int8_array = 22,
  date_time_array = 34  // the types from int8_array on are arrays
};

// Returns the name in the specification: "Int8", "DateTime".
const char* to_text(DataType type) noexcept;

struct Bytes {
  std::string data;
  friend bool operator==(const Bytes&, const Bytes&) = default;
};
// A value of a kind that is not kept.
struct Opaque {
  friend bool operator==(const Opaque&, const Opaque&) = default;
};
// monostate: null.
using Value = std::variant<std::monostate, bool, std::int64_t, std::uint64_t, double, std::string,
                           Bytes, Opaque>;

struct Property {
  std::string key;
  DataType type = DataType::unknown;
  Value value;
  friend bool operator==(const Property&, const Property&) = default;
};

// Describes a file or a part of one. Members that are 0 or empty are not sent.
struct MetaData {
  bool multi_part = false;
  std::string content_type;
  std::uint64_t size = 0;  // bytes
  std::uint64_t part = 0;  // from 0
  std::string file_name;
  std::string file_type;
  std::string md5;
  std::string description;
  friend bool operator==(const MetaData&, const MetaData&) = default;
};

struct Metric {
  std::string name;  // empty: absent, the metric is identified by its alias
  std::optional<std::uint64_t> alias;
  std::optional<std::uint64_t> time_ms;  // since 1970, UTC: when the value was measured
  DataType type = DataType::unknown;
  bool historical = false;
  bool transient = false;
  Value value;
  std::optional<MetaData> metadata;
  std::vector<Property> properties;
  friend bool operator==(const Metric&, const Metric&) = default;

  const Property* property(std::string_view key) const noexcept;
};

struct Payload {
  std::optional<std::uint64_t> time_ms;  // since 1970, UTC: when it was sent
  std::optional<std::uint64_t> seq;
  std::vector<Metric> metrics;
  friend bool operator==(const Payload&, const Payload&) = default;

  // Returns the first metric of that name, or null.
  const Metric* find(std::string_view name) const noexcept;
};

class BadPayload : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

inline constexpr std::size_t kMostPayloadBytes = 4UL * 1024UL * 1024UL;
inline constexpr std::size_t kMostMetrics = 20'000;

// Whether the types of metrics are sent. Births must have them, data and commands should not.
enum class Types : std::uint8_t { sent, left_out };

// Encodes a payload. Each value is written as its metric's type requires. Throws std::logic_error
// if the value does not fit the type, because the caller chose both. A metric of type unknown is
// written by the type of its value.
std::string encode(const Payload& payload, Types types);

// Decodes any bytes. A value that contradicts its type becomes Opaque. Throws BadPayload if:
// - the bytes are not a payload, are too large or contain too many metrics,
// - text is not UTF-8 or has a zero byte,
// - a type does not exist,
// - the two lists of a property set differ in length.
Payload decode(std::string_view bytes);

// Applies the birth's type to an integer of a message without types. Other values are returned
// unchanged.
Value retyped(Value value, DataType type);

// Returns a number unchanged, and 1 or 0 for true or false; nullopt for text, null and other
// values.
std::optional<double> number_of(const Value& value) noexcept;

bool is_signed(DataType type) noexcept;    // Int8 to Int64
bool is_unsigned(DataType type) noexcept;  // UInt8 to UInt64, DateTime
bool is_text(DataType type) noexcept;      // String, Text, UUID

}  // namespace loopwarden::sparkplug
