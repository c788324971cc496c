// SPDX-License-Identifier: Apache-2.0
// A Sparkplug B payload as plain values, and its bytes on the wire.
//
// Numbers carry the type of their metric: a signed one is std::int64_t here, whatever its width, an unsigned one or a
// date std::uint64_t, both kinds of floating point double. Where a message leaves the type out (DDATA does, since the
// birth gave it), an integer is std::uint64_t with the bits of the wire until retyped() gives it its type.
//
// Not kept: what data sets, templates and property sets within property sets hold; such a value is Opaque. Arrays are
// the Bytes of the wire.
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

// Numbers are the specification's (6.4.16).
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
  date_time_array = 34  // all from int8_array to here are arrays
};

// "Int8", "DateTime": as the specification writes it.
const char* to_text(DataType type) noexcept;

struct Bytes {
  std::string data;
  friend bool operator==(const Bytes&, const Bytes&) = default;
};
// There is a value, of a kind that is not kept.
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

// Of a file or a part of one. What is 0 or empty is not sent.
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
  std::string name;  // empty: not there, the alias names it
  std::optional<std::uint64_t> alias;
  std::optional<std::uint64_t> time_ms;  // since 1970, UTC: when the value was taken
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

  // The first of that name; null: none.
  const Metric* find(std::string_view name) const noexcept;
};

class BadPayload : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

inline constexpr std::size_t kMostPayloadBytes = 4UL * 1024UL * 1024UL;
inline constexpr std::size_t kMostMetrics = 20'000;

// Whether each metric's type goes out: births must have it, data and commands should not.
enum class Types : std::uint8_t { sent, left_out };

// The value is written as the metric's type wants it; one that does not fit it is a std::logic_error, since the
// caller chose both. A metric of type unknown goes by its value alone.
std::string encode(const Payload& payload, Types types);

// Any bytes: throws BadPayload if they are no payload, too large, too many metrics, hold text that is not UTF-8
// (or has a zero byte), a type that does not exist, or a property set whose two lists differ in length. A value that
// contradicts its type is Opaque.
Payload decode(std::string_view bytes);

// An integer of a message without types, as the birth's type has it; everything else as it is.
Value retyped(Value value, DataType type);

// Numbers as they are, true and false as 1 and 0; nullopt for text, null and all else.
std::optional<double> number_of(const Value& value) noexcept;

bool is_signed(DataType type) noexcept;    // Int8 to Int64
bool is_unsigned(DataType type) noexcept;  // UInt8 to UInt64, DateTime
bool is_text(DataType type) noexcept;      // String, Text, UUID

}  // namespace loopwarden::sparkplug
