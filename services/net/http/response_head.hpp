// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "services/net/http/message.hpp"

namespace loopwarden::http {

struct HeadOptions {
  bool secure = false;     // over TLS
  bool keep_alive = true;  // the connection stays open
  bool is_head = false;    // answer to a HEAD request: no body follows, but its length is given
};

// Returns the answer's head up to the empty line, with the headers that every answer has. A header
// with a line break in its value is left out.
std::string head_text(const Response& response, const HeadOptions& options);

// Returns {"error": "..."}, with "field" if it is given.
Response error_response(int status, std::string_view text, std::string_view field = {});

// Content policy of the pages: scripts and styles of this origin, no inline ones.
extern const char* const kContentPolicy;

}  // namespace loopwarden::http
