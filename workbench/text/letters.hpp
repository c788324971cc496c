// SPDX-License-Identifier: Apache-2.0
// Letters and digits of tags: ASCII only, whatever the locale.
#pragma once

namespace loopwarden::workbench {

constexpr bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }
constexpr bool is_letter(char c) noexcept {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
}

}  // namespace loopwarden::workbench
