// SPDX-License-Identifier: Apache-2.0
// Records each rename and each sync of this program, in order. Replaces the calls of the C library.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace loopwarden::tests {

struct DiskCall {
  enum class Kind { rename, sync };
  Kind kind = Kind::rename;
  std::filesystem::path path;  // the file that is renamed or synced
  std::filesystem::path to;    // the new name
};

// During its lifetime `seen` is called before each disk call.
class WatchedDisk {
 public:
  explicit WatchedDisk(std::function<void(const DiskCall&)> seen);
  WatchedDisk(const WatchedDisk&) = delete;
  WatchedDisk& operator=(const WatchedDisk&) = delete;
  ~WatchedDisk();
};

// Runs `work` in separate processes. The first is killed before its first rename, the next before
// its second, until one completes. Calls `prepare` before each process, and `check` after it with
// the number of completed renames. Returns the number of renames of the whole work.
std::size_t kill_at_every_rename(const std::function<void()>& prepare,
                                 const std::function<void()>& work,
                                 const std::function<void(std::size_t given)>& check);

// Runs `work` once in a separate process. Copies `folder` to STATES/0, STATES/1, ... before each
// rename and at the end, as a kill at that rename would leave it. Returns the number of copies.
std::size_t keep_every_state(const std::function<void()>& work, const std::filesystem::path& folder,
                             const std::filesystem::path& states);

}  // namespace loopwarden::tests
