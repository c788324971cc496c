// SPDX-License-Identifier: Apache-2.0
// Reads passwords and keys. They are never in a configuration file. They are in a systemd
// credential (LoadCredential= of the unit, a file in $CREDENTIALS_DIRECTORY) or in a file given by
// its path.
#pragma once

#include <filesystem>
#include <string>

namespace loopwarden::base {

struct Secret {
  std::string credential;      // its name; if empty, `file` is used
  std::filesystem::path file;  // if empty as well, there is no secret
  bool given() const noexcept { return !credential.empty() || !file.empty(); }
};

// Returns the path of its file. Throws std::runtime_error if a credential is named and
// $CREDENTIALS_DIRECTORY is not set.
std::filesystem::path path_of(const Secret& secret);
// Returns the first line of its file, at most 4096 bytes. Throws std::runtime_error if the file
// can't be read, or if the line is empty or longer.
std::string read_secret(const Secret& secret);

}  // namespace loopwarden::base
