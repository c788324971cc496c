// SPDX-License-Identifier: Apache-2.0
#include "services/net/http/assets.hpp"

#include <fmt/format.h>
#include <sodium.h>

#include <array>
#include <iterator>
#include <utility>

#include "base/file.hpp"
#include "services/net/http/packing.hpp"
#include "services/net/http/response_head.hpp"

namespace loopwarden::http {
namespace {

constexpr std::array<std::pair<std::string_view, const char*>, 11> kTypes{{
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".svg", "image/svg+xml"},
    {".json", "application/json"},
    {".webmanifest", "application/manifest+json"},
    {".png", "image/png"},
    {".ico", "image/x-icon"},
    {".woff2", "font/woff2"},
    {".txt", "text/plain; charset=utf-8"},
    {"LICENSE", "text/plain; charset=utf-8"},
}};

constexpr int kSmallest = 9;

std::string type_of(std::string_view path) {
  for (const auto& [ending, type] : kTypes) {
    if (path.ends_with(ending)) return type;
  }
  return "application/octet-stream";
}

std::string tag_of(std::string_view bytes) {
  std::array<unsigned char, 16> hash{};
  crypto_generichash(hash.data(), hash.size(), reinterpret_cast<const unsigned char*>(bytes.data()),
                     bytes.size(), nullptr, 0);
  std::string tag = "\"";
  for (const unsigned char byte : hash) fmt::format_to(std::back_inserter(tag), "{:02x}", byte);
  return tag + "\"";
}

std::string joined(const std::vector<std::string>& path) {
  std::string text;
  for (const std::string& part : path) text += (text.empty() ? "" : "/") + part;
  return text.empty() ? "index.html" : text;
}

}  // namespace

Assets::Assets(const std::filesystem::path& folder) {
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    add(entry.path().lexically_relative(folder).generic_string(),
        base::read_file(entry.path()).value_or(""));
  }
}

void Assets::add(const std::string& path, std::string bytes) {
  Asset asset{.type = type_of(path), .tag = tag_of(bytes), .plain = nullptr, .packed = nullptr};
  std::string packed = gzip(bytes, kSmallest);
  if (packed.size() < bytes.size()) {
    asset.packed = std::make_shared<const std::string>(std::move(packed));
  }
  asset.plain = std::make_shared<const std::string>(std::move(bytes));
  assets_[path] = std::move(asset);
}

Response Assets::answer(const Request& request) const {
  const auto found = assets_.find(joined(request.path));
  if (found == assets_.end()) return error_response(404, "there is no such page");
  const Asset& asset = found->second;
  Response response;
  response.content_type = asset.type;
  // Browsers revalidate at each use and get 304 if the file is unchanged. So a new version of the
  // program shows at once.
  response.headers = {
      {"Cache-Control", "no-cache"}, {"ETag", asset.tag}, {"Vary", "Accept-Encoding"}};
  if (request.if_none_match.find(asset.tag) != std::string::npos) {
    response.status = 304;
    return response;
  }
  response.shared = asset.plain;
  if (request.accepts_gzip && asset.packed) {
    response.shared = asset.packed;
    response.headers.emplace_back("Content-Encoding", "gzip");
  }
  return response;
}

}  // namespace loopwarden::http
