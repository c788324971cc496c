// SPDX-License-Identifier: Apache-2.0
// Makes typed text safe for filters and names of a directory.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::page::ldap {

// Returns the text as a value for a filter. No bytes in it can end the value (RFC 4515).
std::string filter_value(std::string_view text);

// Returns `text` with `value` in place of every `placeholder`.
std::string filled(std::string text, std::string_view placeholder, std::string_view value);

// Returns the account's name in lower case, without one of `domains`: "otto" for PLANT\Otto and
// otto@plant.example. It has 1 to 64 of a-z 0-9 . _ -, so it needs no escape in a distinguished
// name and is safe in journals. Returns nullopt for other names.
std::optional<std::string> account_name(std::string_view typed,
                                        const std::vector<std::string>& domains);

}  // namespace loopwarden::page::ldap
