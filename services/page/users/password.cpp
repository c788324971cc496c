// SPDX-License-Identifier: Apache-2.0
#include "services/page/users/password.hpp"

#include <sodium.h>

#include <array>
#include <stdexcept>

namespace loopwarden::page {
namespace {

constexpr std::size_t kTokenBytes = 32;
using TokenBytes = std::array<unsigned char, kTokenBytes>;

void need_sodium() {
  if (sodium_init() < 0) throw std::runtime_error("libsodium finds no random numbers");
}

std::string to_token(const TokenBytes& bytes) {
  std::array<char, sodium_base64_ENCODED_LEN(kTokenBytes, sodium_base64_VARIANT_URLSAFE_NO_PADDING)>
      text{};
  sodium_bin2base64(text.data(), text.size(), bytes.data(), bytes.size(),
                    sodium_base64_VARIANT_URLSAFE_NO_PADDING);
  return text.data();
}

const TokenBytes& key_of_this_run() {
  static const TokenBytes key = [] {
    need_sodium();
    TokenBytes bytes{};
    randombytes_buf(bytes.data(), bytes.size());
    return bytes;
  }();
  return key;
}

}  // namespace

std::string hash_password(std::string_view password, PasswordCost cost) {
  need_sodium();
  const bool least = cost == PasswordCost::least;
  std::array<char, crypto_pwhash_STRBYTES> hash{};
  if (crypto_pwhash_str(hash.data(), password.data(), password.size(),
                        least ? crypto_pwhash_OPSLIMIT_MIN : crypto_pwhash_OPSLIMIT_INTERACTIVE,
                        least ? crypto_pwhash_MEMLIMIT_MIN : crypto_pwhash_MEMLIMIT_INTERACTIVE) !=
      0) {
    throw std::runtime_error("no memory for the password's hash");
  }
  return hash.data();
}

bool is_password(std::string_view password, const std::string& hash) {
  need_sodium();
  return crypto_pwhash_str_verify(hash.c_str(), password.data(), password.size()) == 0;
}

const std::string& nobodys_hash() {
  static const std::string hash = hash_password(random_token());
  return hash;
}

bool is_hash(std::string_view text) noexcept {
  if (!text.starts_with("$argon2id$v=19$m=") || text.size() >= crypto_pwhash_STRBYTES) return false;
  return text.find_first_not_of(
             "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789+/$,=") ==
         std::string_view::npos;
}

std::string random_token() {
  need_sodium();
  TokenBytes bytes{};
  randombytes_buf(bytes.data(), bytes.size());
  return to_token(bytes);
}

std::string fingerprint(std::string_view text) {
  const TokenBytes& key = key_of_this_run();
  TokenBytes hash{};
  crypto_generichash(hash.data(), hash.size(), reinterpret_cast<const unsigned char*>(text.data()),
                     text.size(), key.data(), key.size());
  return to_token(hash);
}

bool same_secret(std::string_view a, std::string_view b) noexcept {
  return a.size() == b.size() && sodium_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace loopwarden::page
