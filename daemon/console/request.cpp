// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/request.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace loopwarden::daemon::console {

using nlohmann::json;

namespace {

// Written out, a document takes a stack frame for each level: one that is all brackets would end the thread.
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
  } catch (const std::exception& e) {
    return text_of({{"ok", false}, {"error", e.what()}});
  }
}

json number(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

double wanted_number(const json& request, const char* key) {
  const json& value = request.at(key);
  if (!value.is_number()) throw RequestError(std::string(key) + " must be a number");
  return value.get<double>();
}

std::string wanted_text(const json& request, const char* key) {
  const auto it = request.find(key);
  if (it == request.end() || !it->is_string()) {
    throw RequestError(std::string("a text is needed for \"") + key + "\"");
  }
  return it->get<std::string>();
}

std::optional<std::uint64_t> optional_count(const json& request, const char* key) {
  const auto it = request.find(key);
  if (it == request.end()) return std::nullopt;
  if (!it->is_number_unsigned()) throw RequestError(std::string(key) + " must be a whole number");
  return it->get<std::uint64_t>();
}

std::uint64_t optional_count(const json& request, const char* key, std::uint64_t fallback) {
  return optional_count(request, key).value_or(fallback);
}

bool optional_flag(const json& request, const char* key) {
  const auto it = request.find(key);
  if (it == request.end()) return false;
  if (!it->is_boolean()) throw RequestError(std::string(key) + " must be true or false");
  return it->get<bool>();
}

std::string optional_text(const json& request, const char* key, std::size_t most) {
  if (!request.contains(key)) return {};
  std::string text = wanted_text(request, key);
  if (text.size() > most) throw RequestError(fmt::format("{}: at most {} bytes", key, most));
  return text;
}

}  // namespace loopwarden::daemon::console
