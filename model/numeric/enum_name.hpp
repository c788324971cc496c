// SPDX-License-Identifier: Apache-2.0
// The text that stands for an enumerator, out of one for each in their order.
#pragma once

#include <cstddef>

namespace loopwarden::numeric {

// `last` is the enumeration's last one, and there are as many names as enumerators. "?" for a value that is none.
template <auto last, std::size_t count>
constexpr const char* enum_name(decltype(last) value, const char* const (&names)[count]) noexcept {
  static_assert(count == static_cast<std::size_t>(last) + 1);
  const auto at = static_cast<std::size_t>(value);
  return at < count ? names[at] : "?";
}

}  // namespace loopwarden::numeric
