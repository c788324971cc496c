// SPDX-License-Identifier: Apache-2.0
#include "base/secret/secret.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <fstream>
#include <stdexcept>

namespace loopwarden::base {

std::filesystem::path path_of(const Secret& secret) {
  if (secret.credential.empty()) return secret.file;
  const char* folder = std::getenv("CREDENTIALS_DIRECTORY");
  if (folder == nullptr) {
    throw std::runtime_error(fmt::format(
        "credential '{}': $CREDENTIALS_DIRECTORY is not set. Add LoadCredential= to the "
        "unit.",
        secret.credential));
  }
  return std::filesystem::path(folder) / secret.credential;
}

std::string read_secret(const Secret& secret) {
  constexpr std::size_t kMostBytes = 4096;
  const std::filesystem::path path = path_of(secret);
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line)) {
    throw std::runtime_error(fmt::format("{}: can't be read or is empty", path.string()));
  }
  if (line.ends_with('\r')) line.pop_back();
  if (line.empty() || line.size() > kMostBytes) {
    throw std::runtime_error(fmt::format("{}: the first line holds the secret, of 1 to {} bytes",
                                         path.string(), kMostBytes));
  }
  return line;
}

}  // namespace loopwarden::base
