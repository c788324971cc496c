// SPDX-License-Identifier: Apache-2.0
#include "tests/support/undeletable.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <mutex>
#include <string>

namespace loopwarden::tests {
namespace {

std::mutex& mutex() {
  // never freed, because deletions at the end of the program use it as well
  static auto* const made = new std::mutex;
  return *made;
}

std::string& kept() {
  static auto* const made = new std::string;
  return *made;
}

bool may_go(int folder, const std::string& name) {
  const std::lock_guard lock(mutex());
  if (kept().empty()) return true;
  std::string path = name;
  if (folder != AT_FDCWD && !name.starts_with('/')) {
    std::array<char, 64> link{};
    std::snprintf(link.data(), link.size(), "/proc/self/fd/%d", folder);
    std::array<char, 4096> target{};
    const ssize_t length = ::readlink(link.data(), target.data(), target.size());
    path =
        std::string(target.data(), length > 0 ? static_cast<std::size_t>(length) : 0) + "/" + name;
  }
  return path != kept() && !path.starts_with(kept() + "/");
}

}  // namespace

Undeletable::Undeletable(const std::filesystem::path& path) {
  const std::lock_guard lock(mutex());
  kept() = std::filesystem::canonical(path).string();
}

Undeletable::~Undeletable() {
  const std::lock_guard lock(mutex());
  kept().clear();
}

}  // namespace loopwarden::tests

extern "C" {

int unlink(const char* path) noexcept {
  static auto* const real = reinterpret_cast<int (*)(const char*)>(dlsym(RTLD_NEXT, "unlink"));
  if (loopwarden::tests::may_go(AT_FDCWD, path)) return real(path);
  errno = EACCES;
  return -1;
}

int unlinkat(int folder, const char* path, int flags) noexcept {
  static auto* const real =
      reinterpret_cast<int (*)(int, const char*, int)>(dlsym(RTLD_NEXT, "unlinkat"));
  if (loopwarden::tests::may_go(folder, path)) return real(folder, path, flags);
  errno = EACCES;
  return -1;
}

}  // extern "C"
