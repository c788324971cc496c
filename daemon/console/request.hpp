// SPDX-License-Identifier: Apache-2.0
// One line of a socket, from request to answer: a JSON object each.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "daemon/protocol/requests.hpp"

namespace loopwarden::daemon::console {

using protocol::RequestError;

// On one line; bytes that are no UTF-8 are replaced.
std::string text_of(const nlohmann::json& value);
// What a handler answers: a line without its end.
std::string done(nlohmann::json reply);  // with "ok": true

// The line of `handler`, or of the error that it throws. `line` may be anything.
std::string answer_line(std::string_view line,
                        const std::function<std::string(const nlohmann::json& request)>& handler);

// Throws RequestError for more than 200 bytes; empty: it is not there.
std::string short_text(const protocol::Maybe<std::string>& text, const char* key);

}  // namespace loopwarden::daemon::console
