// SPDX-License-Identifier: Apache-2.0
// Small things on text that the readers share.
#pragma once

#include <string>
#include <string_view>

namespace loopwarden::base {

// Without the spaces and tabs at both ends.
std::string_view trimmed(std::string_view text) noexcept;
std::string lower_case(std::string_view text);
// For messages: short, and without what a terminal would act on.
std::string in_quotes(std::string_view text);

}  // namespace loopwarden::base
