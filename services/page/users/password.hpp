// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace loopwarden::page {

inline constexpr std::size_t kShortestPassword = 8;    // bytes
inline constexpr std::size_t kLongestPassword = 1024;  // bytes

// What argon2id costs: memory and time of one log-in.
enum class PasswordCost {
  usual,  // 64 MiB, 2 passes: some tenths of a second
  least   // for tests
};

// argon2id by libsodium, as text that says its own cost and salt. Throws std::runtime_error where memory is short.
std::string hash_password(std::string_view password, PasswordCost cost = PasswordCost::usual);

// Takes as long for a hash that nobody has (`nobodys_hash`) as for a user's.
bool is_password(std::string_view password, const std::string& hash);
// Of no password, with the usual cost; made once.
const std::string& nobodys_hash();

// Whether `text` may stand in a users file as a hash.
bool is_hash(std::string_view text) noexcept;

// 256 random bits, as 43 characters that need no escaping anywhere.
std::string random_token();
// BLAKE2b of `text` under a key made at the program's start, as a token.
std::string fingerprint(std::string_view text);
// Takes as long whether and wherever the two differ.
bool same_secret(std::string_view a, std::string_view b) noexcept;

}  // namespace loopwarden::page
