// SPDX-License-Identifier: Apache-2.0
#include "services/page/ldap/ldap_text.hpp"

#include <ldap.h>

#include <algorithm>
#include <new>

#include "base/text.hpp"

namespace loopwarden::page::ldap {
namespace {

constexpr std::size_t kLongestName = 64;  // as the daemon takes it

bool is_one_of(std::string_view domain, const std::vector<std::string>& domains) {
  return std::any_of(domains.begin(), domains.end(), [&](const std::string& known) {
    return base::lower_case(known) == base::lower_case(std::string(domain));
  });
}

}  // namespace

std::string filter_value(std::string_view text) {
  std::string bytes(text);
  berval in{bytes.size(), bytes.data()};
  berval out{0, nullptr};
  if (bytes.empty()) return {};
  if (ldap_bv2escaped_filter_value(&in, &out) != 0) throw std::bad_alloc();
  std::string value(out.bv_val, out.bv_len);
  ber_memfree(out.bv_val);
  return value;
}

std::string filled(std::string text, std::string_view placeholder, std::string_view value) {
  for (std::size_t at = text.find(placeholder); at != std::string::npos;
       at = text.find(placeholder, at + value.size())) {
    text.replace(at, placeholder.size(), value);
  }
  return text;
}

std::optional<std::string> account_name(std::string_view typed,
                                        const std::vector<std::string>& domains) {
  if (const std::size_t back = typed.find('\\'); back != std::string_view::npos) {
    if (!is_one_of(typed.substr(0, back), domains)) return std::nullopt;
    typed.remove_prefix(back + 1);
  } else if (const std::size_t at = typed.find('@'); at != std::string_view::npos) {
    if (!is_one_of(typed.substr(at + 1), domains)) return std::nullopt;
    typed = typed.substr(0, at);
  }
  std::string name = base::lower_case(std::string(typed));
  const bool sound =
      !name.empty() && name.size() <= kLongestName &&
      name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789._-") == std::string::npos;
  return sound ? std::optional(std::move(name)) : std::nullopt;
}

}  // namespace loopwarden::page::ldap
