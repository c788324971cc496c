// SPDX-License-Identifier: Apache-2.0
#include "base/file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace loopwarden::base {

File::File(const std::filesystem::path& path, int flags, unsigned mode) noexcept
    : fd_(::open(path.c_str(), flags | O_CLOEXEC, mode)) {}

File& File::operator=(File&& other) noexcept {
  if (this != &other) {
    close();
    fd_ = std::exchange(other.fd_, -1);
  }
  return *this;
}

bool File::close() noexcept {
  if (fd_ < 0) return true;
  // The descriptor is gone even when close() is interrupted.
  return ::close(std::exchange(fd_, -1)) == 0 || errno == EINTR;
}

bool File::write(const void* data, std::size_t size) noexcept {
  const char* next = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = ::write(fd_, next, size);
    if (written < 0) {
      if (errno == EINTR) continue;
      return false;
    }
    next += written;
    size -= static_cast<std::size_t>(written);
  }
  return true;
}

bool File::write_at(const void* data, std::size_t size, std::size_t offset) noexcept {
  const char* next = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = ::pwrite(fd_, next, size, static_cast<off_t>(offset));
    if (written < 0) {
      if (errno == EINTR) continue;
      return false;
    }
    next += written;
    offset += static_cast<std::size_t>(written);
    size -= static_cast<std::size_t>(written);
  }
  return true;
}

bool File::sync() noexcept { return ::fdatasync(fd_) == 0; }

bool sync_folder(const std::filesystem::path& folder) noexcept {
  const File handle(folder.empty() ? std::filesystem::path(".") : folder, O_RDONLY | O_DIRECTORY);
  return handle.is_open() && ::fsync(handle.fd()) == 0;
}

std::string error_text(int error) { return std::generic_category().message(error); }

}  // namespace loopwarden::base
