// SPDX-License-Identifier: Apache-2.0
// How the structs of this folder become JSON. A key has the name of its member.
//
//   double          null where it is no number
//   std::optional   null where it is not there
//   Maybe           left out where it is not there
//
// Reading: the first member must be there, for all others the default stands where a daemon of another version does not
// send them; what is not a member is left out. Throws nlohmann::json::exception.
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
