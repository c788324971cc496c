// SPDX-License-Identifier: Apache-2.0
// Passwords and keys: never in a configuration file, but in a systemd credential (LoadCredential= of the unit, a file
// in $CREDENTIALS_DIRECTORY) or in a file given by its path.
#pragma once

#include <filesystem>
#include <string>

namespace loopwarden::base {

struct Secret {
  std::string credential;      // its name; empty: a file
  std::filesystem::path file;  // empty as well: there is none
  bool given() const noexcept { return !credential.empty() || !file.empty(); }
};

// Where it lies. Throws std::runtime_error where a credential is named and the service has none at all.
std::filesystem::path path_of(const Secret& secret);
// Its first line; at most 4096 bytes. Throws std::runtime_error where it can't be read or is empty.
std::string read_secret(const Secret& secret);

}  // namespace loopwarden::base
