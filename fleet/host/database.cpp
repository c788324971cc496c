// SPDX-License-Identifier: Apache-2.0
#include "fleet/host/database.hpp"

#include <array>
#include <cstdlib>
#include <mutex>
#include <utility>

namespace loopwarden::fleet {
namespace {

constexpr std::array kParameters{
    std::pair{"connect_timeout", "5"},  std::pair{"tcp_user_timeout", "15000"},
    std::pair{"keepalives_idle", "5"},  std::pair{"keepalives_interval", "5"},
    std::pair{"keepalives_count", "2"}, std::pair{"application_name", "loopwarden-fleet"}};

// What the URL says itself counts.
std::string with_parameters(std::string url) {
  for (const auto& [key, value] : kParameters) {
    if (url.find(std::string(key) + '=') != std::string::npos) continue;
    url += url.find('?') == std::string::npos ? '?' : '&';
    url += std::string(key) + '=' + value;
  }
  return url;
}

}  // namespace

std::unique_ptr<pqxx::connection> open_database(const DatabaseSettings& settings) {
  {
    // libpq takes it from the environment; in the URL it would stand in error messages.
    static std::mutex mutex;
    const std::lock_guard lock(mutex);
    if (settings.password.given()) {
      ::setenv("PGPASSWORD", read_secret(settings.password).c_str(), 1);
    }
  }
  auto connection = std::make_unique<pqxx::connection>(with_parameters(settings.url));
  pqxx::nontransaction setting(*connection);
  setting.exec(
      "SET statement_timeout = '60s'; SET TIME ZONE 'UTC'; SET client_min_messages = warning");
  return connection;
}

}  // namespace loopwarden::fleet
