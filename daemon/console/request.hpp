// SPDX-License-Identifier: Apache-2.0
// One line of a socket, from request to answer: a JSON object each.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace loopwarden::daemon::console {

// A request that can't be served; its text goes to the peer.
class RequestError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// On one line; bytes that are no UTF-8 are replaced.
std::string text_of(const nlohmann::json& value);
// What a handler answers: a line without its end.
std::string done(nlohmann::json reply);  // with "ok": true

// The line of `handler`, or of the error that it throws. `line` may be anything.
std::string answer_line(std::string_view line,
                        const std::function<std::string(const nlohmann::json& request)>& handler);

// A number, or null where it is none.
nlohmann::json number(double value);

// What stands at a key of a request, or RequestError.
double wanted_number(const nlohmann::json& request, const char* key);
std::string wanted_text(const nlohmann::json& request, const char* key);
std::optional<std::uint64_t> optional_count(const nlohmann::json& request, const char* key);
std::uint64_t optional_count(const nlohmann::json& request, const char* key,
                             std::uint64_t fallback);
bool optional_flag(const nlohmann::json& request, const char* key);
// At most `most` bytes; empty: it is not there.
std::string optional_text(const nlohmann::json& request, const char* key, std::size_t most);

}  // namespace loopwarden::daemon::console
