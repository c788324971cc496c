// SPDX-License-Identifier: Apache-2.0
// A disk that hangs for as long as the test requires: open, pwrite, fsync and fdatasync of files
// below a folder wait, as in the kernel. They are replaced for this whole program, and don't wait
// if no HungDisk exists.
#pragma once

#include <atomic>
#include <filesystem>

namespace loopwarden::tests {

class HungDisk {
 public:
  // Hangs from now on. Only one can exist at a time.
  explicit HungDisk(const std::filesystem::path& folder);
  HungDisk(const HungDisk&) = delete;
  HungDisk& operator=(const HungDisk&) = delete;
  ~HungDisk() { release(); }

  // All waiting calls continue.
  void release();
  // Returns the number of calls that wait now.
  int waiting() const noexcept;
};

}  // namespace loopwarden::tests
