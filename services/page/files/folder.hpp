// SPDX-License-Identifier: Apache-2.0
// Reads only below one folder: no part of a path may be a link or lead up.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace loopwarden::page::files {

class Folder {
 public:
  explicit Folder(std::filesystem::path path) : path_(std::move(path)) {}

  // Returns the regular file at `parts`; nullopt if it is missing, or larger than `most_bytes`.
  std::optional<std::string> read(const std::vector<std::string>& parts,
                                  std::size_t most_bytes) const;
  // Returns its first bytes.
  std::optional<std::string> read_start(const std::vector<std::string>& parts,
                                        std::size_t most_bytes) const;
  // Returns the regular files in the folder at `parts`, by name; at most `most`.
  std::vector<std::string> list(const std::vector<std::string>& parts, std::size_t most) const;

  const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
};

// Returns whether the name is neither empty nor hidden and has no slash and no control character.
bool is_sound_name(const std::string& name) noexcept;

}  // namespace loopwarden::page::files
