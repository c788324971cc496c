// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "services/net/http/message.hpp"

namespace loopwarden::http {

// gzip; level from 1 (fastest) to 9 (smallest).
std::string gzip(std::string_view bytes, int level);

// Makes a body smaller where its client takes gzip and it is text that is worth it. Nothing of what the handlers' pools
// answer is a secret beside something that a stranger chose, so its length gives nothing away.
void pack(Response& response, const Request& request) noexcept;

}  // namespace loopwarden::http
