// SPDX-License-Identifier: Apache-2.0
#include "services/database/database_settings.hpp"

#include <fmt/format.h>

#include <string_view>

#include "config/diagnostic.hpp"
#include "config/file_keys.hpp"

namespace loopwarden::fleet {

// Refuses a password in the URL ("postgresql://user:secret@host"). Users who can read the file or
// the list of processes would see it.
std::optional<std::string> database_url_error(const std::string& url, const char* password_key) {
  if (!url.starts_with("postgresql://") && !url.starts_with("postgres://")) {
    return fmt::format("must be postgresql://[USER@]HOST[:PORT]/NAME (got '{}')",
                       config::quotable(url));
  }
  const std::string_view behind = std::string_view(url).substr(url.find("//") + 2);
  const std::string_view user = behind.substr(0, behind.find_first_of("@/"));
  const bool has_user = behind.substr(0, behind.find('/')).find('@') != std::string_view::npos;
  if ((has_user && user.find(':') != std::string_view::npos) ||
      url.find("password=") != std::string::npos) {
    return fmt::format("holds a password; use {} with a credential or a file", password_key);
  }
  return std::nullopt;
}

DatabaseSettings read_database_settings(config::MapReader& in, config::Presence presence,
                                        const char* password_key, const std::string& file) {
  constexpr const char* kForm = "postgresql://[USER@]HOST[:PORT]/NAME";
  const config::Value<std::string> url = presence == config::Presence::required
                                             ? in.need_text("database", kForm)
                                             : in.text("database", kForm, "");
  if (url.given && url.valid) {
    if (const auto error = database_url_error(url.value, password_key)) {
      in.error("database", *error);
    }
  }
  return {url, config::read_secret_at(in, password_key, "password of the database's user", file)};
}

}  // namespace loopwarden::fleet
