// SPDX-License-Identifier: Apache-2.0
#include "config/file_keys.hpp"

#include <optional>
#include <utility>

#include "config/source_file.hpp"

namespace loopwarden::config {

std::string read_path(MapReader& in, std::string_view key, const char* meaning,
                      const std::string& file, std::string fallback) {
  const Value<std::string> path = in.text(key, meaning, std::move(fallback));
  return path.valid && !path.value.empty() ? resolve(file, path.value).string() : std::string();
}

base::Secret read_secret_at(MapReader& in, std::string_view key, const char* meaning,
                            const std::string& file) {
  base::Secret secret;
  std::optional<MapReader> section = in.maybe_section(key, meaning);
  if (!section) return secret;
  const Value<std::string> credential =
      section->text("credential", "its name, as in LoadCredential= of the unit", "");
  secret.credential = credential;
  secret.file = read_path(*section, "file", "file with the secret in its first line", file);
  if (secret.credential.find('/') != std::string::npos) {
    section->error("credential", "must be a name, without '/'");
  }
  if (!section->describing() && secret.credential.empty() == secret.file.empty()) {
    section->error("must have either `credential` or `file`");
  }
  return secret;
}

}  // namespace loopwarden::config
