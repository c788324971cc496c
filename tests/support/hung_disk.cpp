// SPDX-License-Identifier: Apache-2.0
#include "tests/support/hung_disk.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cstdarg>
#include <cstdio>
#include <list>
#include <string>
#include <string_view>

namespace loopwarden::tests {
namespace {

std::atomic<bool> hangs{false};
std::atomic<int> waiters{0};
std::atomic<const std::string*> folder{nullptr};

void wait_below(std::string_view path) {
  if (!path.starts_with(*folder.load())) return;
  ++waiters;
  while (hangs.load()) ::usleep(1000);
  --waiters;
}

void wait_for(int fd) {
  if (!hangs.load()) return;
  std::array<char, 64> link{};
  std::snprintf(link.data(), link.size(), "/proc/self/fd/%d", fd);
  std::array<char, 4096> path{};
  const ssize_t length = ::readlink(link.data(), path.data(), path.size());
  if (length > 0) wait_below(std::string_view(path.data(), static_cast<std::size_t>(length)));
}

template <class F>
F* original(const char* name) {
  return reinterpret_cast<F*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

HungDisk::HungDisk(const std::filesystem::path& below) {
  static auto* const all =
      new std::list<std::string>;  // never freed, because a call can still use the last one
  folder = &all->emplace_back(std::filesystem::canonical(below).string() + "/");
  hangs = true;
}

void HungDisk::release() { hangs = false; }

int HungDisk::waiting() const noexcept { return waiters.load(); }

}  // namespace loopwarden::tests

extern "C" {

// NOLINTBEGIN(cert-dcl50-cpp): their signatures are those of the C library
int open(const char* path, int flags, ...) {
  mode_t mode = 0;
  if ((flags & (O_CREAT | O_TMPFILE)) != 0) {
    va_list more;
    va_start(more, flags);
    mode = va_arg(more, mode_t);
    va_end(more);
  }
  static auto* const real = loopwarden::tests::original<int(const char*, int, ...)>("open");
  if (loopwarden::tests::hangs.load()) loopwarden::tests::wait_below(path);
  return real(path, flags, mode);
}
int open64(const char* path, int flags, ...) {
  mode_t mode = 0;
  if ((flags & (O_CREAT | O_TMPFILE)) != 0) {
    va_list more;
    va_start(more, flags);
    mode = va_arg(more, mode_t);
    va_end(more);
  }
  static auto* const real = loopwarden::tests::original<int(const char*, int, ...)>("open64");
  if (loopwarden::tests::hangs.load()) loopwarden::tests::wait_below(path);
  return real(path, flags, mode);
}
// NOLINTEND(cert-dcl50-cpp)
ssize_t pwrite(int fd, const void* data, std::size_t size, off_t at) {
  static auto* const real =
      loopwarden::tests::original<ssize_t(int, const void*, std::size_t, off_t)>("pwrite");
  loopwarden::tests::wait_for(fd);
  return real(fd, data, size, at);
}
ssize_t pwrite64(int fd, const void* data, std::size_t size, off64_t at) {
  static auto* const real =
      loopwarden::tests::original<ssize_t(int, const void*, std::size_t, off64_t)>("pwrite64");
  loopwarden::tests::wait_for(fd);
  return real(fd, data, size, at);
}
int fsync(int fd) {
  static auto* const real = loopwarden::tests::original<int(int)>("fsync");
  loopwarden::tests::wait_for(fd);
  return real(fd);
}
int fdatasync(int fd) {
  static auto* const real = loopwarden::tests::original<int(int)>("fdatasync");
  loopwarden::tests::wait_for(fd);
  return real(fd);
}

}  // extern "C"
