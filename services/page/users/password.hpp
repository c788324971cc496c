// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace loopwarden::page {

inline constexpr std::size_t kShortestPassword = 8;    // bytes
inline constexpr std::size_t kLongestPassword = 1024;  // bytes

// Cost of argon2id: memory and time of one log-in.
enum class PasswordCost {
  usual,  // 64 MiB, 2 passes: some tenths of a second
  least   // for tests
};

// Returns an argon2id hash by libsodium, as text with its cost and salt. Throws std::runtime_error
// if memory is short.
std::string hash_password(std::string_view password, PasswordCost cost = PasswordCost::usual);

// Takes the same time for the hash of no user (`nobodys_hash`) as for a user's.
bool is_password(std::string_view password, const std::string& hash);
// Returns a hash of no password, with the usual cost; made once.
const std::string& nobodys_hash();

// Returns whether `text` is valid as a hash in a users file.
bool is_hash(std::string_view text) noexcept;

// Returns 256 random bits, as 43 characters that need no escaping anywhere.
std::string random_token();
// Returns BLAKE2b of `text` under a key made at the program's start, as a token.
std::string fingerprint(std::string_view text);
// Compares in constant time, wherever the two differ.
bool same_secret(std::string_view a, std::string_view b) noexcept;

}  // namespace loopwarden::page
