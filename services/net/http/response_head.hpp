// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "services/net/http/message.hpp"

namespace loopwarden::http {

struct HeadOptions {
  bool secure = false;     // over TLS
  bool keep_alive = true;  // the connection stays open
  bool is_head = false;    // of a HEAD request: no body follows, its length is told all the same
};

// The answer's head, up to the empty line, with the headers that every answer has. A line break in a value ends nothing:
// such a header is left out.
std::string head_text(const Response& response, const HeadOptions& options);

// {"error": "..."}, and "field" where one is named.
Response error_response(int status, std::string_view text, std::string_view field = {});

// What the pages themselves may do: scripts and styles of this origin, nothing inline.
extern const char* const kContentPolicy;

}  // namespace loopwarden::http
