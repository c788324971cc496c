// SPDX-License-Identifier: Apache-2.0
// What this program asks of the disk: each rename and each wait for it, in their order. In the
// place of the C library's calls.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace loopwarden::tests {

struct DiskCall {
  enum class Kind { rename, sync };
  Kind kind = Kind::rename;
  std::filesystem::path path;  // what is given a name, or waited for
  std::filesystem::path to;    // the name
};

// While it lives `seen` is called before each call is carried out.
class WatchedDisk {
 public:
  explicit WatchedDisk(std::function<void(const DiskCall&)> seen);
  WatchedDisk(const WatchedDisk&) = delete;
  WatchedDisk& operator=(const WatchedDisk&) = delete;
  ~WatchedDisk();
};

// Runs `work` in processes of their own: the first is killed before its first rename, the next
// before its second, until one ends by itself. `check` is called after each, with the number of
// names that were given; before each `prepare` is called. Returns how many renames the whole work
// takes.
std::size_t kill_at_every_rename(const std::function<void()>& prepare,
                                 const std::function<void()>& work,
                                 const std::function<void(std::size_t given)>& check);

// Runs `work` once, in a process of its own, and copies `folder` to STATES/0, STATES/1, ... before
// each rename and at the end: what a kill at that rename would leave. Returns how many copies there
// are.
std::size_t keep_every_state(const std::function<void()>& work, const std::filesystem::path& folder,
                             const std::filesystem::path& states);

}  // namespace loopwarden::tests
