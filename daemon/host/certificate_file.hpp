// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace loopwarden::daemon::host {

// When the first certificate of a PEM file ends, s since 1970; nothing: it can't be read, or is none.
std::optional<std::int64_t> end_of_certificate(const std::string& file);

}  // namespace loopwarden::daemon::host
