// SPDX-License-Identifier: Apache-2.0
#include "services/net/http/response_head.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>

namespace loopwarden::http {
namespace {

const char* reason_of(int status) {
  switch (status) {
    case 200: return "OK";
    case 302: return "Found";
    case 304: return "Not Modified";
    case 400: return "Bad Request";
    case 401: return "Unauthorized";
    case 403: return "Forbidden";
    case 404: return "Not Found";
    case 405: return "Method Not Allowed";
    case 409: return "Conflict";
    case 411: return "Length Required";
    case 413: return "Content Too Large";
    case 414: return "URI Too Long";
    case 415: return "Unsupported Media Type";
    case 417: return "Expectation Failed";
    case 429: return "Too Many Requests";
    case 431: return "Request Header Fields Too Large";
    case 500: return "Internal Server Error";
    case 503: return "Service Unavailable";
    case 505: return "HTTP Version Not Supported";
    default: return "Error";
  }
}

bool names(const Response& response, std::string_view name) {
  return std::any_of(response.headers.begin(), response.headers.end(),
                     [&](const auto& header) { return header.first == name; });
}

// Adds the headers of every answer, except those that the answer sets itself.
void add_usual(std::string& head, const Response& response, bool secure) {
  const auto usual = [&](std::string_view name, std::string_view value) {
    if (!names(response, name)) fmt::format_to(std::back_inserter(head), "{}: {}\r\n", name, value);
  };
  usual("Content-Security-Policy", kContentPolicy);
  usual("X-Content-Type-Options", "nosniff");
  usual("Referrer-Policy", "no-referrer");
  usual("Cross-Origin-Opener-Policy", "same-origin");
  usual("Cross-Origin-Resource-Policy", "same-origin");
  usual("X-Frame-Options", "SAMEORIGIN");
  usual("Cache-Control", "no-store");
  if (secure) usual("Strict-Transport-Security", "max-age=31536000");
}

}  // namespace

const char* const kContentPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; font-src 'self'; form-action 'self'; base-uri 'none'; "
    "frame-ancestors 'none'; frame-src 'self'";

std::string head_text(const Response& response, const HeadOptions& options) {
  std::string head = fmt::format("HTTP/1.1 {} {}\r\n", response.status, reason_of(response.status));
  if (response.status != 304) {
    fmt::format_to(std::back_inserter(head), "Content-Type: {}\r\n", response.content_type);
    if (response.source) {
      head += "Transfer-Encoding: chunked\r\n";
    } else if (!response.may_stay) {
      fmt::format_to(std::back_inserter(head), "Content-Length: {}\r\n", response.text().size());
    }
  }
  for (const auto& [name, value] : response.headers) {
    if (value.find_first_of("\r\n") != std::string::npos) continue;
    fmt::format_to(std::back_inserter(head), "{}: {}\r\n", name, value);
  }
  add_usual(head, response, options.secure);
  if (!options.keep_alive) head += "Connection: close\r\n";
  return head + "\r\n";
}

Response error_response(int status, std::string_view text, std::string_view field) {
  nlohmann::json body = {{"error", text}};
  if (!field.empty()) body["field"] = field;
  Response response;
  response.status = status;
  response.body = body.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return response;
}

}  // namespace loopwarden::http
