// SPDX-License-Identifier: Apache-2.0
#include "services/net/http/packing.hpp"

#include <zlib.h>

#include <memory>
#include <stdexcept>
#include <utility>

namespace loopwarden::http {
namespace {

constexpr std::size_t kOnePacket = 1400;

bool is_packed(const Response& response) {
  for (const auto& [name, value] : response.headers) {
    if (name == "Content-Encoding") return true;
  }
  return false;
}

}  // namespace

std::string gzip(std::string_view bytes, int level) {
  z_stream stream{};
  constexpr int kGzipWindow = 15 + 16;
  if (deflateInit2(&stream, level, Z_DEFLATED, kGzipWindow, 9, Z_DEFAULT_STRATEGY) != Z_OK) {
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

void pack(Response& response, const Request& request) noexcept {
  const bool text =
      response.content_type == "application/json" || response.content_type.starts_with("text/");
  if (!text || response.source || response.may_stay || is_packed(response)) return;
  if (response.text().size() <= kOnePacket) return;
  try {
    response.headers.emplace_back("Vary", "Accept-Encoding");
    if (!request.accepts_gzip) return;
    auto packed = std::make_shared<const std::string>(gzip(response.text(), Z_BEST_SPEED));
    response.headers.emplace_back("Content-Encoding", "gzip");
    response.shared = std::move(packed);
    response.body.clear();
  } catch (const std::exception&) {
    // Without memory for compression the body is sent as it is.
  }
}

}  // namespace loopwarden::http
