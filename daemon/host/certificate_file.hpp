// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace loopwarden::daemon::host {

// Returns when the first certificate of a PEM file ends, s since 1970; nullopt if it is unreadable
// or not a certificate.
std::optional<std::int64_t> end_of_certificate(const std::string& file);

}  // namespace loopwarden::daemon::host
