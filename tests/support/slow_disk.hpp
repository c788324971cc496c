// SPDX-License-Identifier: Apache-2.0
// A slow disk for some files of a program that a test starts, by the fault campaign's shim
// (tests/system/fault_campaign/shim.c).
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests {

// Programs started during its lifetime use it, also afterwards.
class SlowDisk {
 public:
  // Bits of the shim's kHanging.
  enum class File : std::int64_t { edge_store = 1 << 6, notifications = 1 << 7 };

  SlowDisk() {
    const std::string file = (folder_ / "switches").string();
    const int fd = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (fd < 0 || ::ftruncate(fd, kBytes) != 0) throw std::runtime_error("no file of switches");
    map_ = ::mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    ::close(fd);
    if (map_ == MAP_FAILED) throw std::runtime_error("no map of switches");
    ::setenv("LD_PRELOAD", LOOPWARDEN_BIN_DIR "/fault_shim.so", 1);
    ::setenv("LOOPWARDEN_FAULTS", file.c_str(), 1);
  }
  SlowDisk(const SlowDisk&) = delete;
  SlowDisk& operator=(const SlowDisk&) = delete;
  ~SlowDisk() {
    ::unsetenv("LD_PRELOAD");
    ::unsetenv("LOOPWARDEN_FAULTS");
    ::munmap(map_, kBytes);
  }

  // Sets how long each opening, renaming and syncing of these files takes.
  void slow(File file, std::chrono::milliseconds each) {
    put(1, each.count());
    put(0, static_cast<std::int64_t>(file));
  }
  // Returns the number of slow calls.
  std::int64_t calls() const {
    std::int64_t count = 0;
    std::memcpy(&count, at(2), sizeof count);
    return count;
  }

 private:
  // Layout as in struct Switches of the shim: earlier fields, then files, ms, count.
  static constexpr std::size_t kBefore = 8 * (4 + 16 + 16 + 4 * 1024 + 2);
  static constexpr std::size_t kBytes = kBefore + 24;
  std::byte* at(std::size_t index) const {
    return static_cast<std::byte*>(map_) + kBefore + 8 * index;
  }
  void put(std::size_t index, std::int64_t value) { std::memcpy(at(index), &value, sizeof value); }

  TemporaryFolder folder_;
  void* map_ = nullptr;
};

}  // namespace loopwarden::tests
