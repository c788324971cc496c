// SPDX-License-Identifier: Apache-2.0
#include "services/page/api/body.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>

#include "config/diagnostic.hpp"
#include "services/page/api/context.hpp"

namespace loopwarden::page::api {
namespace {

using nlohmann::json;

[[noreturn]] void refuse(std::string_view key, const std::string& what) {
  throw ApiError(400, fmt::format("{}: {}", key, what), std::string(key));
}

void refuse_unknown(std::string_view key, std::initializer_list<std::string_view> keys) {
  const std::vector<std::string> known(keys.begin(), keys.end());
  if (std::find(known.begin(), known.end(), key) != known.end()) return;
  refuse(config::quotable(key), "there is no such key" + config::suggestion(key, known));
}

}  // namespace

void check_keys(const json& object, std::string_view name,
                std::initializer_list<std::string_view> keys) {
  if (!object.is_object()) refuse(name, "expected an object");
  for (const auto& [key, value] : object.items()) refuse_unknown(key, keys);
}

json object_of(const http::Request& request, std::initializer_list<std::string_view> keys) {
  json body = json::parse(request.body, nullptr, false);
  if (body.is_discarded()) throw ApiError(400, "the body is no JSON");
  check_keys(body, "body", keys);
  return body;
}

std::string text_at(const json& object, const char* key, std::size_t longest) {
  const auto it = object.find(key);
  if (it == object.end() || !it->is_string()) refuse(key, "expected a text");
  const auto& text = it->get_ref<const std::string&>();
  if (text.size() > longest) refuse(key, fmt::format("at most {} bytes", longest));
  const bool printable = std::none_of(text.begin(), text.end(), [](char c) {
    return static_cast<unsigned char>(c) < 0x20 || c == 0x7F;
  });
  if (!printable) refuse(key, "a text on one line");
  return text;
}

std::string text_or(const json& object, const char* key, std::size_t longest,
                    std::string fallback) {
  return object.contains(key) ? text_at(object, key, longest) : std::move(fallback);
}

std::int64_t whole_at(const json& object, const char* key, std::int64_t low, std::int64_t high) {
  const auto it = object.find(key);
  if (it == object.end() || !it->is_number_integer()) refuse(key, "expected a whole number");
  // A number beyond 63 bits is unsigned.
  const bool huge =
      it->is_number_unsigned() && it->get<std::uint64_t>() > static_cast<std::uint64_t>(INT64_MAX);
  const std::int64_t value = huge ? INT64_MAX : it->get<std::int64_t>();
  if (value < low || value > high) refuse(key, fmt::format("must be from {} to {}", low, high));
  return value;
}

std::optional<std::int64_t> whole_in(const http::Request& request, const char* key,
                                     std::int64_t low, std::int64_t high) {
  const auto it = request.query.find(key);
  if (it == request.query.end() || it->second.empty()) return std::nullopt;
  const std::string& text = it->second;
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) {
    refuse(key, "expected a whole number");
  }
  if (value < low || value > high) refuse(key, fmt::format("must be from {} to {}", low, high));
  return value;
}

std::string text_in(const http::Request& request, const char* key, std::size_t longest) {
  const auto it = request.query.find(key);
  if (it == request.query.end()) return {};
  if (it->second.size() > longest) refuse(key, fmt::format("at most {} bytes", longest));
  return it->second;
}

void check_query(const http::Request& request, std::initializer_list<std::string_view> keys) {
  for (const auto& [key, value] : request.query) refuse_unknown(key, keys);
}

std::string dump(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

http::Response json_response(const json& value) {
  http::Response response;
  response.body = dump(value);
  return response;
}

}  // namespace loopwarden::page::api
