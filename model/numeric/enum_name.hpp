// SPDX-License-Identifier: Apache-2.0
// The name of an enumerator, from a list of names in the order of the enumeration.
#pragma once

#include <cstddef>

namespace loopwarden::numeric {

// Returns the name of `value`, or "?" for a number without an enumerator. `last` is the last
// enumerator. `names` has exactly one name per enumerator.
template <auto last, std::size_t count>
constexpr const char* enum_name(decltype(last) value, const char* const (&names)[count]) noexcept {
  static_assert(count == static_cast<std::size_t>(last) + 1);
  const auto at = static_cast<std::size_t>(value);
  return at < count ? names[at] : "?";
}

}  // namespace loopwarden::numeric
