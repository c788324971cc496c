// SPDX-License-Identifier: Apache-2.0
#include "page/http/assets.hpp"

#include <fmt/format.h>
#include <sodium.h>
#include <zlib.h>

#include <array>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "page/http/response_head.hpp"

namespace loopwarden::page::http {
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

std::string gzip(std::string_view bytes) {
  z_stream stream{};
  constexpr int kGzipWindow = 15 + 16;
  if (deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kGzipWindow, 9, Z_DEFAULT_STRATEGY) !=
      Z_OK) {
    throw std::runtime_error("no memory for zlib");
  }
  std::string packed(deflateBound(&stream, static_cast<uLong>(bytes.size())), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  const int result = deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  if (result != Z_STREAM_END) throw std::runtime_error("zlib can't compress");
  return packed;
}

Assets::Assets(const std::filesystem::path& folder) {
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream file(entry.path(), std::ios::binary);
    add(entry.path().lexically_relative(folder).generic_string(),
        std::string(std::istreambuf_iterator<char>(file), {}));
  }
}

void Assets::add(const std::string& path, std::string bytes) {
  Asset asset{.type = type_of(path), .tag = tag_of(bytes), .plain = nullptr, .packed = nullptr};
  std::string packed = gzip(bytes);
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
  // Asked for again each time, answered by 304: a new version of the program shows at once.
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

}  // namespace loopwarden::page::http
