// SPDX-License-Identifier: Apache-2.0
// A file or folder that can't be deleted, whoever the test runs as: unlink and unlinkat of it and of what is in it fail
// with EACCES. They are replaced for this whole program.
#pragma once

#include <filesystem>

namespace loopwarden::tests {

class Undeletable {
 public:
  // One at a time.
  explicit Undeletable(const std::filesystem::path& path);
  Undeletable(const Undeletable&) = delete;
  Undeletable& operator=(const Undeletable&) = delete;
  ~Undeletable();
};

}  // namespace loopwarden::tests
