// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "lab/hidden_cases/hidden_case.hpp"

namespace loopwarden::hidden_cases {

// Parses "single,none". Throws std::invalid_argument for an unknown word or an empty list.
std::vector<Kind> parse_kinds(std::string_view list);

}  // namespace loopwarden::hidden_cases
