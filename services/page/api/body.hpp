// SPDX-License-Identifier: Apache-2.0
// Reads bodies and queries strictly: a key that no handler reads is an error that names the key.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "services/net/http/message.hpp"

namespace loopwarden::page::api {

// Returns the body as an object. Throws ApiError 400 if it has other keys than these.
nlohmann::json object_of(const http::Request& request,
                         std::initializer_list<std::string_view> keys);
// Checks the keys of an object within the body in the same way.
void check_keys(const nlohmann::json& object, std::string_view name,
                std::initializer_list<std::string_view> keys);

// Return the value at `key`. Throw ApiError 400 if it is missing or of another type.
std::string text_at(const nlohmann::json& object, const char* key, std::size_t longest);
std::string text_or(const nlohmann::json& object, const char* key, std::size_t longest,
                    std::string fallback);
std::int64_t whole_at(const nlohmann::json& object, const char* key, std::int64_t low,
                      std::int64_t high);

// Returns a value of the query; nullopt if the key is absent or empty. Throws ApiError 400.
std::optional<std::int64_t> whole_in(const http::Request& request, const char* key,
                                     std::int64_t low, std::int64_t high);
std::string text_in(const http::Request& request, const char* key, std::size_t longest);
void check_query(const http::Request& request, std::initializer_list<std::string_view> keys);

inline constexpr std::int64_t kLastMoment_ms = 4'102'444'800'000;  // 2100

// Returns JSON. Invalid bytes in texts are replaced.
std::string dump(const nlohmann::json& value);
http::Response json_response(const nlohmann::json& value);

}  // namespace loopwarden::page::api
