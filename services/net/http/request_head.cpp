// SPDX-License-Identifier: Apache-2.0
#include "services/net/http/request_head.hpp"

#include <algorithm>
#include <charconv>

#include "base/text.hpp"

namespace loopwarden::http {
namespace {

constexpr std::size_t kLongestTarget = 4096;

using base::lower_case;
using base::trimmed;

std::size_t count(const RequestHead& head, std::string_view name) {
  return static_cast<std::size_t>(
      std::count_if(head.fields.begin(), head.fields.end(),
                    [&](const auto& field) { return lower_case(field.first) == name; }));
}

std::string_view field(const RequestHead& head, std::string_view name) {
  for (const auto& [key, value] : head.fields) {
    if (lower_case(key) == name) return trimmed(value);
  }
  return {};
}

// Calls `each` for the parts between separators. Stops and returns false when `each` returns false.
template <class Each>
bool for_parts(std::string_view text, char separator, Each each) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(separator), text.size());
    if (!each(text.substr(0, end))) return false;
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return true;
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

// Returns whether a part is safe. Parts that could leave their folder, or that another program
// would split in two, are not.
bool is_sound_part(const std::string& part) {
  return part != "." && part != ".." && part.find_first_of("/\\") == std::string::npos;
}

std::optional<std::vector<std::string>> path_of(std::string_view text) {
  std::vector<std::string> path;
  const bool sound = for_parts(text.substr(1), '/', [&](std::string_view part) {
    std::optional<std::string> plain = decoded(part);
    if (!plain || plain->empty() || !is_sound_part(*plain)) return false;
    path.push_back(std::move(*plain));
    return true;
  });
  if (!sound) return std::nullopt;
  return path;
}

std::optional<std::map<std::string, std::string>> query_of(std::string_view text) {
  std::map<std::string, std::string> query;
  const bool sound = for_parts(text, '&', [&](std::string_view pair) {
    const std::size_t equals = std::min(pair.find('='), pair.size());
    const auto key = decoded(pair.substr(0, equals), true);
    const auto value = decoded(pair.substr(std::min(equals + 1, pair.size())), true);
    if (!key || !value) return false;
    query[*key] = *value;
    return true;
  });
  if (!sound) return std::nullopt;
  return query;
}

std::string_view path_text(std::string_view target) { return target.substr(0, target.find('?')); }

std::string_view query_text(std::string_view target) {
  const std::size_t mark = target.find('?');
  return mark == std::string_view::npos ? std::string_view() : target.substr(mark + 1);
}

std::map<std::string, std::string> cookies_of(std::string_view text) {
  std::map<std::string, std::string> cookies;
  for_parts(text, ';', [&](std::string_view pair) {
    const std::size_t equals = pair.find('=');
    if (equals != std::string_view::npos) {
      cookies.emplace(trimmed(pair.substr(0, equals)), trimmed(pair.substr(equals + 1)));
    }
    return true;
  });
  return cookies;
}

// Returns whether the client accepts gzip. Of the quality values, only a refusal (q=0) is
// evaluated.
bool accepts_gzip(std::string_view text) {
  bool accepts = false;
  for_parts(text, ',', [&](std::string_view one) {
    const std::string coding = lower_case(trimmed(one));
    if (coding == "gzip" || (coding.starts_with("gzip;") && !coding.ends_with("q=0"))) {
      accepts = true;
    }
    return true;
  });
  return accepts;
}

Method method_of(std::string_view text) {
  if (text == "GET") return Method::get;
  if (text == "HEAD") return Method::head;
  if (text == "POST") return Method::post;
  return Method::other;
}

std::optional<Refusal> refused_promise(const RequestHead& head) {
  if (count(head, "expect") > 0) return Refusal{417, "Expect is not supported"};
  return std::nullopt;
}

std::optional<Refusal> refused_body(const RequestHead& head) {
  if (count(head, "transfer-encoding") > 0) {
    return Refusal{411, "a body needs a Content-Length; transfer encodings are not supported"};
  }
  if (count(head, "content-length") > 1) return Refusal{400, "more than one Content-Length"};
  const std::string_view length = field(head, "content-length");
  if (count(head, "content-length") == 0) return refused_promise(head);
  std::uint64_t bytes = 0;
  const auto [end, error] = std::from_chars(length.begin(), length.end(), bytes);
  if (error == std::errc::result_out_of_range) return Refusal{413, "the body is too large"};
  if (error != std::errc() || end != length.end()) {
    return Refusal{400, "the Content-Length is not a number"};
  }
  if (bytes > kMostBodyBytes) return Refusal{413, "a body has at most 64 KiB"};
  if (bytes > 0 && head.method != "POST") return Refusal{400, "only POST has a body"};
  return refused_promise(head);
}

}  // namespace

std::optional<std::string> decoded(std::string_view text, bool plus) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '%') {
      if (i + 2 >= text.size()) return std::nullopt;
      const int high = hex_digit(text[i + 1]);
      const int low = hex_digit(text[i + 2]);
      if (high < 0 || low < 0) return std::nullopt;
      c = static_cast<char>(high * 16 + low);
      i += 2;
    } else if (plus && c == '+') {
      c = ' ';
    }
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F) return std::nullopt;
    plain += c;
  }
  return plain;
}

std::optional<Refusal> refusal_of(const RequestHead& head) {
  if (count(head, "host") != 1) return Refusal{400, "a request must have exactly one Host"};
  if (head.target.size() > kLongestTarget) return Refusal{414, "the address is too long"};
  if (!head.target.starts_with('/')) return Refusal{400, "the address is not a path"};
  if (!path_of(path_text(head.target))) return Refusal{400, "the path is invalid"};
  if (!query_of(query_text(head.target))) return Refusal{400, "the query can't be read"};
  return refused_body(head);
}

Request request_of(const RequestHead& head) {
  Request request;
  request.method = method_of(head.method);
  request.path = path_of(path_text(head.target)).value_or(std::vector<std::string>());
  request.query = query_of(query_text(head.target)).value_or(std::map<std::string, std::string>());
  request.cookies = cookies_of(field(head, "cookie"));
  request.host = lower_case(field(head, "host"));
  request.origin = field(head, "origin");
  request.fetch_site = field(head, "sec-fetch-site");
  request.csrf = field(head, "x-csrf-token");
  const std::string_view type = field(head, "content-type");
  request.content_type = lower_case(trimmed(type.substr(0, type.find(';'))));
  request.if_none_match = field(head, "if-none-match");
  request.person = field(head, "x-loopwarden-person") == "1";
  request.accepts_gzip = accepts_gzip(field(head, "accept-encoding"));
  return request;
}

}  // namespace loopwarden::http
