// SPDX-License-Identifier: Apache-2.0
// Reads below one folder and nowhere else: no part of a path is a link, and none leads up.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace loopwarden::page::files {

class Folder {
 public:
  explicit Folder(std::filesystem::path path) : path_(std::move(path)) {}

  // The regular file at `parts`; nullopt if there is none, or it is larger than `most_bytes`.
  std::optional<std::string> read(const std::vector<std::string>& parts,
                                  std::size_t most_bytes) const;
  // Its first bytes.
  std::optional<std::string> read_start(const std::vector<std::string>& parts,
                                        std::size_t most_bytes) const;
  // Regular files in the folder at `parts`, by name; at most `most`.
  std::vector<std::string> list(const std::vector<std::string>& parts, std::size_t most) const;

  const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
};

// Neither empty nor hidden, no slash, no control character.
bool is_sound_name(const std::string& name) noexcept;

}  // namespace loopwarden::page::files
