// SPDX-License-Identifier: Apache-2.0
// Converts the structs of this folder to and from JSON. A key has the name of its member.
//
//   double          NaN is written as null
//   std::optional   nullopt is written as null
//   Maybe           nullopt is left out
//
// Reading: the first member is required. Other members keep their default if absent, because a
// daemon of another version may not send them. Unknown keys are ignored. Throws
// nlohmann::json::exception.
#pragma once

#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <type_traits>

namespace loopwarden::protocol {

inline constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

template <class T>
struct Maybe : std::optional<T> {
  using std::optional<T>::optional;
};

template <class T>
requires std::is_aggregate_v<T>
void to_json(nlohmann::json& to, const T& message);
template <class T>
requires std::is_aggregate_v<T>
void from_json(const nlohmann::json& from, T& message);

}  // namespace loopwarden::protocol
