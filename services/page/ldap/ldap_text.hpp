// SPDX-License-Identifier: Apache-2.0
// What people type, made fit for filters and names of a directory.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::page::ldap {

// As a value in a filter: it can't end the value, whatever bytes it has (RFC 4515).
std::string filter_value(std::string_view text);

// `text` with `value` in every place of `placeholder`.
std::string filled(std::string text, std::string_view placeholder, std::string_view value);

// The account's name in lower case, without one of `domains`: "otto" of PLANT\Otto and otto@plant.example. 1 to 64 of
// a-z 0-9 . _ -, so that it needs no escape in a distinguished name and journals can bear it; else nothing.
std::optional<std::string> account_name(std::string_view typed,
                                        const std::vector<std::string>& domains);

}  // namespace loopwarden::page::ldap
