// SPDX-License-Identifier: Apache-2.0
// Parses the head of a request into a Request. A head that two programs could read differently is
// refused.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "services/net/http/message.hpp"

namespace loopwarden::http {

struct RequestHead {
  std::string method;
  std::string target;
  std::vector<std::pair<std::string, std::string>> fields;  // in their order; names in any case
};

struct Refusal {
  int status = 400;
  const char* why = "";
};

inline constexpr std::size_t kMostBodyBytes = 64UL * 1024UL;

// Returns the error of a head, before any of the body is read. A body needs a Content-Length.
// Chunked bodies are refused, as is everything else that request smuggling relies on.
std::optional<Refusal> refusal_of(const RequestHead& head);

// Returns the request of a valid head. The caller fills in peer and body.
Request request_of(const RequestHead& head);

// Undoes percent-encoding. With `plus`, + is a space. Returns nullopt if the encoding is wrong or
// contains a control character.
std::optional<std::string> decoded(std::string_view text, bool plus = false);

}  // namespace loopwarden::http
