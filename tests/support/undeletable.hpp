// SPDX-License-Identifier: Apache-2.0
// A file or folder that can't be deleted by any user: unlink and unlinkat of it and of its content
// fail with EACCES. They are replaced for this whole program.
#pragma once

#include <filesystem>

namespace loopwarden::tests {

class Undeletable {
 public:
  // Only one can exist at a time.
  explicit Undeletable(const std::filesystem::path& path);
  Undeletable(const Undeletable&) = delete;
  Undeletable& operator=(const Undeletable&) = delete;
  ~Undeletable();
};

}  // namespace loopwarden::tests
