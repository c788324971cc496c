// SPDX-License-Identifier: Apache-2.0
// Declares the members of a struct once for both JSON directions. For the sources of this folder.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/protocol/message.hpp"

namespace loopwarden::protocol {

// put() and take() of a struct. PROTOCOL_LISTED defines them from a list of members. Members adds
// to the list if a struct needs more.
template <class T>
struct Listed;
template <class T>
struct Members : Listed<T> {};

// Writes the members of the optional `part` among those of T. The part is present if its first
// member is.
template <class T, class P, std::optional<P> T::*part>
struct WithPart {
  static void put(nlohmann::json& to, const T& message) {
    Listed<T>::put(to, message);
    if (message.*part) Members<P>::put(to, *(message.*part));
  }
  static void take(const nlohmann::json& from, T& message) {
    Listed<T>::take(from, message);
    if (from.contains(Listed<P>::kFirst)) Members<P>::take(from, (message.*part).emplace());
  }
};

template <class T>
requires std::is_aggregate_v<T>
void to_json(nlohmann::json& to, const T& message) { Members<T>::put(to, message); }
template <class T>
requires std::is_aggregate_v<T>
void from_json(const nlohmann::json& from, T& message) { Members<T>::take(from, message); }

// Returns the JSON key of a member. A member whose key is a C++ keyword ends with an underscore.
constexpr std::string_view key_of(std::string_view member) {
  return member.ends_with('_') ? member.substr(0, member.size() - 1) : member;
}

template <class T>
void write(nlohmann::json& to, std::string_view key, const T& value) {
  to[std::string(key)] = value;
}
inline void write(nlohmann::json& to, std::string_view key, double value) {
  to[std::string(key)] = std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr);
}
inline void write(nlohmann::json& to, std::string_view key, const std::vector<double>& values) {
  nlohmann::json& all = to[std::string(key)] = nlohmann::json::array();
  for (const double value : values) {
    all.push_back(std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr));
  }
}
template <class T>
void write(nlohmann::json& to, std::string_view key, const std::optional<T>& value) {
  to[std::string(key)] = value ? nlohmann::json(*value) : nlohmann::json(nullptr);
}
template <class T>
void write(nlohmann::json& to, std::string_view key, const Maybe<T>& value) {
  if (value) write(to, key, *value);
}

inline void read_value(const nlohmann::json& from, double& value) {
  value = from.is_null() ? kNone : from.get<double>();
}
inline void read_value(const nlohmann::json& from, std::vector<double>& values) {
  values.resize(from.size());
  for (std::size_t i = 0; i < values.size(); ++i) read_value(from.at(i), values[i]);
}
template <class T>
void read_value(const nlohmann::json& from, T& value) {
  if (!from.is_null()) from.get_to(value);
}
template <class T>
void read_value(const nlohmann::json& from, std::optional<T>& value) {
  if (!from.is_null()) read_value(from, value.emplace());
}
template <class T>
void read_value(const nlohmann::json& from, Maybe<T>& value) {
  read_value(from, value.emplace());
}
template <class T>
void read(const nlohmann::json& from, std::string_view key, T& value) {
  if (const auto it = from.find(key); it != from.end()) read_value(*it, value);
}

template <class T>
void check_there(const nlohmann::json& from, const char* key, const T&) {
  (void)from.at(key);
}
template <class T>
void check_there(const nlohmann::json&, const char*, const Maybe<T>&) {}

}  // namespace loopwarden::protocol

#define PROTOCOL_WRITE(member) write(to, key_of(#member), message.member);
#define PROTOCOL_READ(member) read(from, key_of(#member), message.member);

#define PROTOCOL_LISTED(Type, first, ...)                                                         \
  template <>                                                                                     \
  struct Listed<Type> {                                                                           \
    static constexpr const char* kFirst = #first;                                                 \
    static void put(nlohmann::json& to, const Type& message) {                                    \
      NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(PROTOCOL_WRITE, first __VA_OPT__(, ) __VA_ARGS__)) \
    }                                                                                             \
    static void take(const nlohmann::json& from, Type& message) {                                 \
      check_there(from, kFirst, message.first);                                                   \
      NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(PROTOCOL_READ, first __VA_OPT__(, ) __VA_ARGS__))  \
    }                                                                                             \
  };

// Instantiates the conversions that other sources call. It must follow Listed or Members of the
// type.
#define PROTOCOL_DEFINE(Type)                          \
  template void to_json(nlohmann::json&, const Type&); \
  template void from_json(const nlohmann::json&, Type&);

#define PROTOCOL_JSON(Type, ...)     \
  PROTOCOL_LISTED(Type, __VA_ARGS__) \
  PROTOCOL_DEFINE(Type)
