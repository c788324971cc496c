// SPDX-License-Identifier: Apache-2.0
// Checksums, and bytes in lower-case hexadecimal.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace loopwarden::base {

std::string to_hex(std::span<const std::uint8_t> bytes);

// Return 64 hexadecimal digits.
std::string sha256_hex(std::string_view bytes);
std::string hmac_sha256_hex(std::string_view key, std::string_view bytes);
// Throws std::runtime_error if the file can't be read.
std::string sha256_hex_of_file(const std::filesystem::path& file);

// Returns the CRC-32 of zlib, continued from `start` over `bytes`.
std::uint32_t crc32(std::span<const char> bytes, std::uint32_t start = 0) noexcept;

}  // namespace loopwarden::base
