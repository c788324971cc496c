// SPDX-License-Identifier: Apache-2.0
// Reads any bytes as the name of a user who logs in by a directory. The resulting name has few
// characters. In a filter any bytes stay one value and the same bytes.
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "services/page/ldap/ldap_text.hpp"
#include "tests/fuzz/require.hpp"

using loopwarden::tests::fuzz::require;
namespace ldap = loopwarden::page::ldap;

namespace {

int digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

// Returns the value that a server reads (RFC 4515).
std::optional<std::string> read_back(std::string_view value) {
  std::string bytes;
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (value[i] != '\\') {
      bytes += value[i];
      continue;
    }
    if (i + 2 >= value.size() || digit(value[i + 1]) < 0 || digit(value[i + 2]) < 0) return {};
    bytes += static_cast<char>(16 * digit(value[i + 1]) + digit(value[i + 2]));
    i += 2;
  }
  return bytes;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view typed(reinterpret_cast<const char*>(data), size);
  static const std::vector<std::string> domains{"PLANT", "plant.example"};
  if (const auto name = ldap::account_name(typed, domains)) {
    require(!name->empty() && name->size() <= 64, "a length");
    require(name->find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789._-") == std::string::npos,
            "few characters");
    require(ldap::filter_value(*name) == *name, "nothing to escape");
    require(ldap::account_name(*name, {}) == name, "its own name");
  }
  const std::string value = ldap::filter_value(typed);
  require(value.find_first_of(std::string_view("*()\0", 4)) == std::string::npos, "one value");
  require(read_back(value) == typed, "the same bytes");
  const std::string filter = ldap::filled("(uid={user})", "{user}", value);
  require(filter == "(uid=" + value + ")", "in its place");
  return 0;
}
