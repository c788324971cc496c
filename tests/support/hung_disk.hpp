// SPDX-License-Identifier: Apache-2.0
// A disk that hangs for as long as the test likes: open, pwrite, fsync and fdatasync of files below a
// folder wait in the kernel's place. They are replaced for this whole program, and do nothing of the
// kind where there is no HungDisk.
#pragma once

#include <atomic>
#include <filesystem>

namespace loopwarden::tests {

class HungDisk {
 public:
  // Hangs from now on; one at a time.
  explicit HungDisk(const std::filesystem::path& folder);
  HungDisk(const HungDisk&) = delete;
  HungDisk& operator=(const HungDisk&) = delete;
  ~HungDisk() { release(); }

  // Everything that waits goes on.
  void release();
  // Calls that wait now.
  int waiting() const noexcept;
};

}  // namespace loopwarden::tests
