// SPDX-License-Identifier: Apache-2.0
// Where the fleet's PostgreSQL is. Its password never stands in the URL.
#pragma once

#include <optional>
#include <string>

#include "config/map_reader.hpp"
#include "base/secret/secret.hpp"

namespace loopwarden::fleet {

struct DatabaseSettings {
  std::string url;  // postgresql://...
  base::Secret password;
};

// Why `url` can't be one; nullopt if it can. `password_key` is the key that a password belongs to.
std::optional<std::string> database_url_error(const std::string& url, const char* password_key);

// The keys `database` and `password_key`. `file`: where relative paths start.
DatabaseSettings read_database_settings(config::MapReader& in, config::Presence presence,
                                        const char* password_key, const std::string& file);

}  // namespace loopwarden::fleet
