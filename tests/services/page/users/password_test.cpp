// SPDX-License-Identifier: Apache-2.0
#include "services/page/users/password.hpp"

#include <catch2/catch.hpp>

#include <set>

namespace loopwarden::tests::password_test {

using namespace page;

TEST_CASE("a hash accepts its own password and no other") {
  const std::string hash = hash_password("correct horse", PasswordCost::least);
  CHECK(is_hash(hash));
  CHECK(hash.find("correct") == std::string::npos);
  CHECK(is_password("correct horse", hash));
  CHECK_FALSE(is_password("correct horsf", hash));
  CHECK_FALSE(is_password("", hash));
  CHECK(hash != hash_password("correct horse", PasswordCost::least));
}

TEST_CASE("the hash for unknown users costs as much as a user's") {
  const std::string usual = hash_password("x");
  const auto cost = [](const std::string& hash) { return hash.substr(0, hash.find('$', 20)); };
  CHECK(cost(nobodys_hash()) == cost(usual));
}

TEST_CASE("a text that is no hash by argon2id is recognized") {
  for (const char* text :
       {"", "secret", "$argon2i$v=19$m=8,t=1,p=1$x$y", "$argon2id$v=19$m=8,t=1:x"}) {
    CHECK_FALSE(is_hash(text));
  }
}

TEST_CASE("tokens have 256 bits and no two are the same") {
  std::set<std::string> tokens;
  for (int i = 0; i < 1000; ++i) tokens.insert(random_token());
  CHECK(tokens.size() == 1000);
  CHECK(tokens.begin()->size() == 43);
  CHECK(same_secret("abc", "abc"));
  CHECK_FALSE(same_secret("abc", "abd"));
  CHECK_FALSE(same_secret("abc", "ab"));
}

}  // namespace loopwarden::tests::password_test
