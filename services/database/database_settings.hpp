// SPDX-License-Identifier: Apache-2.0
// The address of the fleet's PostgreSQL. The URL never contains the password.
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

// Returns the error of `url`, or nullopt if it is valid. `password_key` is the name of the key for
// the password.
std::optional<std::string> database_url_error(const std::string& url, const char* password_key);

// Reads the keys `database` and `password_key`. `file`: base of relative paths.
DatabaseSettings read_database_settings(config::MapReader& in, config::Presence presence,
                                        const char* password_key, const std::string& file);

}  // namespace loopwarden::fleet
