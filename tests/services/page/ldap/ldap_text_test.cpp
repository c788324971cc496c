// SPDX-License-Identifier: Apache-2.0
#include "services/page/ldap/ldap_text.hpp"

#include <catch2/catch.hpp>

#include "tests/support/property.hpp"

namespace loopwarden::tests::ldap_text_test {

using page::ldap::account_name;
using page::ldap::filled;
using page::ldap::filter_value;

// Returns the value that a server decodes (RFC 4515).
std::string read_back(const std::string& value) {
  std::string bytes;
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (value[i] == '\\') {
      bytes += static_cast<char>(std::stoi(value.substr(i + 1, 2), nullptr, 16));
      i += 2;
    } else {
      bytes += value[i];
    }
  }
  return bytes;
}

TEST_CASE("a value in a filter stays one value with any bytes") {
  CHECK(filter_value("otto") == "otto");
  CHECK(filter_value("").empty());
  CHECK(read_back(filter_value("a*(b)\\c")) == "a*(b)\\c");
  property::for_all("escaped", 2000, [] {
    std::string bytes;
    for (auto n = property::integer(0, 40); n > 0; --n) {
      constexpr std::string_view kOdd("*()\\\0&|!=", 9);
      bytes += property::coin() ? kOdd[property::one_of(kOdd.size())]
                                : static_cast<char>(property::integer(0, 255));
    }
    const std::string value = filter_value(bytes);
    property::require(value.find_first_of(std::string_view("*()\0", 4)) == std::string::npos,
                      "no special character of a filter");
    property::require(read_back(value) == bytes, "the same bytes");
  });
}

TEST_CASE("placeholders") {
  CHECK(filled("(|(a={user})(b={user}))", "{user}", "otto") == "(|(a=otto)(b=otto))");
  CHECK(filled("(a=b)", "{user}", "otto") == "(a=b)");
  CHECK(filled("{user}", "{user}", "{user}x") == "{user}x");
}

TEST_CASE("the account's name is found in the typed name") {
  const std::vector<std::string> domains{"PLANT", "plant.example"};
  for (const char* typed :
       {"otto", "Otto", "PLANT\\otto", "plant\\OTTO", "otto@plant.example", "Otto@Plant.Example"}) {
    CHECK(account_name(typed, domains) == "otto");
  }
  CHECK(account_name("10042", {}) == "10042");
  CHECK(account_name("a.b-c_d", {}) == "a.b-c_d");
  for (const char* typed : {"OTHER\\otto", "otto@other.example", "PLANT\\", "@plant.example", "",
                            "PLANT\\x\\otto", "PLANT\\otto@plant.example", "ot to", "otto*",
                            "\xc3\xb6tto", "cn=otto", "\\otto", "otto@"}) {
    CHECK_FALSE(account_name(typed, domains));
  }
  CHECK_FALSE(account_name("PLANT\\otto", {}));
  CHECK(account_name(std::string(64, 'a'), {}));
  CHECK_FALSE(account_name(std::string(65, 'a'), {}));
}

}  // namespace loopwarden::tests::ldap_text_test
