// SPDX-License-Identifier: Apache-2.0
#include "base/digest/digest.hpp"

#include <nettle/hmac.h>
#include <nettle/sha2.h>
#include <zlib.h>

#include <array>
#include <fstream>
#include <stdexcept>

namespace loopwarden::base {
namespace {

using Sha256 = std::array<std::uint8_t, SHA256_DIGEST_SIZE>;

const std::uint8_t* bytes_of(std::string_view text) {
  return reinterpret_cast<const std::uint8_t*>(text.data());
}

}  // namespace

std::string to_hex(std::span<const std::uint8_t> bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  text.reserve(2 * bytes.size());
  for (const std::uint8_t byte : bytes) {
    text += kDigits[byte >> 4U];
    text += kDigits[byte & 0xFU];
  }
  return text;
}

std::string sha256_hex(std::string_view bytes) {
  sha256_ctx context{};
  Sha256 digest{};
  sha256_init(&context);
  sha256_update(&context, bytes.size(), bytes_of(bytes));
  sha256_digest(&context, digest.size(), digest.data());
  return to_hex(digest);
}

std::string hmac_sha256_hex(std::string_view key, std::string_view bytes) {
  hmac_sha256_ctx context{};
  Sha256 digest{};
  hmac_sha256_set_key(&context, key.size(), bytes_of(key));
  hmac_sha256_update(&context, bytes.size(), bytes_of(bytes));
  hmac_sha256_digest(&context, digest.size(), digest.data());
  return to_hex(digest);
}

std::string sha256_hex_of_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error(file.string() + " can't be read");
  sha256_ctx context{};
  Sha256 digest{};
  sha256_init(&context);
  std::array<char, 65536> buffer{};
  do {
    stream.read(buffer.data(), buffer.size());
    sha256_update(&context, static_cast<std::size_t>(stream.gcount()),
                  reinterpret_cast<const std::uint8_t*>(buffer.data()));
  } while (stream);
  sha256_digest(&context, digest.size(), digest.data());
  return to_hex(digest);
}

std::uint32_t crc32(std::span<const char> bytes, std::uint32_t start) noexcept {
  if (bytes.empty()) return start;  // of no address zlib returns 0
  return static_cast<std::uint32_t>(
      ::crc32_z(start, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace loopwarden::base
