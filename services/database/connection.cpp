// SPDX-License-Identifier: Apache-2.0
#include "services/database/connection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <exception>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "base/text.hpp"

namespace loopwarden::fleet {
namespace {

constexpr std::array kParameters{
    std::pair{"connect_timeout", "5"}, std::pair{"tcp_user_timeout", "15000"},
    std::pair{"keepalives_idle", "5"}, std::pair{"keepalives_interval", "5"},
    std::pair{"keepalives_count", "2"}};

void add(std::string& url, std::string_view key, std::string_view value) {
  url += url.find('?') == std::string::npos ? '?' : '&';
  url.append(key).append("=").append(value);
}

// Adds parameters to the URL. Parameters in the URL itself take precedence.
std::string with_parameters(std::string url, const char* program) {
  const auto add_missing = [&](const char* key, const char* value) {
    if (url.find(std::string(key) + '=') == std::string::npos) add(url, key, value);
  };
  for (const auto& [key, value] : kParameters) add_missing(key, value);
  add_missing("application_name", program);
  return url;
}

// Removes the URL from an error text: libpq repeats a URL that it can't parse.
std::string without(std::string text, const std::string& secret) {
  for (std::size_t at = 0; (at = text.find(secret, at)) != std::string::npos;) {
    text.replace(at, secret.size(), "***");
  }
  return text;
}

// Passes the password as a parameter. The environment (PGPASSWORD) is unsafe, because other threads
// may read it meanwhile.
std::unique_ptr<pqxx::connection> connected(std::string url, const base::Secret& password) {
  if (!password.given()) return std::make_unique<pqxx::connection>(url);
  const std::string encoded = base::percent_encoded(base::read_secret(password));
  add(url, "password", encoded);
  try {
    return std::make_unique<pqxx::connection>(url);
  } catch (const std::exception& e) {
    throw std::runtime_error(without(e.what(), encoded));
  }
}

}  // namespace

std::unique_ptr<pqxx::connection> open_database(const DatabaseSettings& settings,
                                                const Purpose& purpose) {
  std::unique_ptr<pqxx::connection> connection =
      connected(with_parameters(settings.url, purpose.program), settings.password);
  // libpqxx stores these variables and sets them again when it reopens a lost connection.
  connection->set_variable("statement_timeout", fmt::format("'{}s'", purpose.statement_seconds));
  connection->set_variable("TimeZone", "'UTC'");
  connection->set_variable("client_min_messages", "warning");
  if (purpose.read_only) {
    connection->set_variable("default_transaction_read_only", "on");
    connection->set_variable("jit", "off");
  }
  return connection;
}

}  // namespace loopwarden::fleet
