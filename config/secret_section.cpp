// SPDX-License-Identifier: Apache-2.0
#include "config/secret_section.hpp"

#include <optional>

#include "config/source_file.hpp"

namespace loopwarden::config {

base::Secret read_secret_section(MapReader& in, std::string_view key, const char* meaning,
                                 const std::string& file) {
  base::Secret secret;
  std::optional<MapReader> section = in.maybe_section(key, meaning);
  if (!section) return secret;
  const config::Value<std::string> credential =
      section->text("credential", "its name, as in LoadCredential= of the unit", "");
  const config::Value<std::string> path =
      section->text("file", "a file whose first line it is", "");
  secret.credential = credential;
  if (path.given && path.valid) secret.file = config::resolve(file, path.value);
  if (!section->describing() && credential.given == path.given) {
    section->error("must have one of credential and file");
  }
  return secret;
}

}  // namespace loopwarden::config
