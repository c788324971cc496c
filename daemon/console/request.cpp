// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/request.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace loopwarden::daemon::console {

using nlohmann::json;

namespace {

// The parser needs a stack frame per level: a deeply nested document would overflow the stack.
json parsed(std::string_view line) {
  constexpr int kDeepest = 8;
  return json::parse(line, [](int depth, json::parse_event_t, json&) {
    if (depth > kDeepest) throw RequestError("a request has at most 8 levels");
    return true;
  });
}

}  // namespace

std::string text_of(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::string done(json reply) {
  reply["ok"] = true;
  return text_of(reply);
}

std::string answer_line(std::string_view line,
                        const std::function<std::string(const json& request)>& handler) {
  try {
    const json request = parsed(line);
    if (!request.is_object()) throw RequestError("a request is a JSON object");
    return handler(request);
  } catch (const protocol::NotYet& e) {
    return text_of({{"ok", false}, {"error", e.what()}, {"try_again", true}});
  } catch (const std::exception& e) {
    return text_of({{"ok", false}, {"error", e.what()}});
  }
}

std::string short_text(const protocol::Maybe<std::string>& text, const char* key) {
  constexpr std::size_t kMost = 200;  // bytes
  if (text && text->size() > kMost) {
    throw RequestError(fmt::format("{}: at most {} bytes", key, kMost));
  }
  return text.value_or("");
}

}  // namespace loopwarden::daemon::console
