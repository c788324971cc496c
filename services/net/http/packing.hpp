// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "services/net/http/message.hpp"

namespace loopwarden::http {

// Returns `bytes` compressed with gzip, at `level` 1 (fastest) to 9 (smallest).
std::string gzip(std::string_view bytes, int level);

// Compresses a body if the client accepts gzip and the body is text of sufficient length. The
// length of an answer reveals no secret: the handlers' pools never put a secret and text chosen by
// a stranger into one answer.
void pack(Response& response, const Request& request) noexcept;

}  // namespace loopwarden::http
