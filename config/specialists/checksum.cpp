// SPDX-License-Identifier: Apache-2.0
#include "config/specialists/checksum.hpp"

#include <fmt/format.h>
#include <nettle/sha2.h>

#include <array>
#include <cstdint>

namespace loopwarden::config {

std::string sha256_of(std::string_view bytes) {
  const std::basic_string<std::uint8_t> copy(bytes.begin(), bytes.end());
  std::array<std::uint8_t, SHA256_DIGEST_SIZE> digest{};
  sha256_ctx context{};
  sha256_init(&context);
  sha256_update(&context, copy.size(), copy.data());
  sha256_digest(&context, digest.size(), digest.data());
  std::string text;
  for (const std::uint8_t byte : digest) text += fmt::format("{:02x}", byte);
  return text;
}

}  // namespace loopwarden::config
