// SPDX-License-Identifier: Apache-2.0
// From the lines of a request's head to a Request. Strict: what two programs could read in two ways is refused.
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
  std::vector<std::pair<std::string, std::string>> fields;  // in their order, names in any case
};

struct Refusal {
  int status = 400;
  const char* why = "";
};

inline constexpr std::size_t kMostBodyBytes = 64UL * 1024UL;

// What is wrong with the head by itself, before any of the body is read. A body needs a Content-Length: chunked
// ones are refused, with all that smuggling lives of.
std::optional<Refusal> refusal_of(const RequestHead& head);

// Of a head that is not refused. Its peer and body are for the caller to fill in.
Request request_of(const RequestHead& head);

// Undoes percent-encoding; `plus`: + is a space. Returns nullopt if the encoding is wrong or holds a control character.
std::optional<std::string> decoded(std::string_view text, bool plus = false);

}  // namespace loopwarden::http
