// SPDX-License-Identifier: Apache-2.0
// Request and answer on a socket: one line with a JSON object each.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "daemon/protocol/requests.hpp"

namespace loopwarden::daemon::console {

using protocol::RequestError;

// Returns one line of text. Bytes that are not UTF-8 are replaced.
std::string text_of(const nlohmann::json& value);
// Returns the answer of a handler as a line, with "ok": true, without the line break.
std::string done(nlohmann::json reply);

// Returns the line of `handler`, or a line with the error that it throws. `line` may be any bytes.
std::string answer_line(std::string_view line,
                        const std::function<std::string(const nlohmann::json& request)>& handler);

// Returns the text, or an empty one if it is missing. Throws RequestError above 200 bytes.
std::string short_text(const protocol::Maybe<std::string>& text, const char* key);

}  // namespace loopwarden::daemon::console
