// SPDX-License-Identifier: Apache-2.0
#include "base/file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
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
  // close() releases the descriptor even if it is interrupted.
  return ::close(std::exchange(fd_, -1)) == 0 || errno == EINTR;
}

std::optional<std::string> File::read(std::size_t most_bytes) const {
  constexpr std::size_t kLeastBytes = 64UL * 1024UL;
  std::string text;
  std::size_t size = 0;
  while (size < most_bytes) {
    // The size of a pipe's content is not known in advance.
    if (size == text.size()) text.resize(std::min(std::max(2 * size, kLeastBytes), most_bytes));
    const ssize_t got = ::read(fd_, text.data() + size, text.size() - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return std::nullopt;
    if (got == 0) break;
    size += static_cast<std::size_t>(got);
  }
  text.resize(size);
  return text;
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

std::optional<std::string> read_file(const std::filesystem::path& path, std::size_t most_bytes) {
  const File file(path, O_RDONLY);
  if (!file.is_open()) return std::nullopt;
  std::optional<std::string> text = file.read(most_bytes + 1);
  if (text && text->size() > most_bytes) {
    errno = EFBIG;
    return std::nullopt;
  }
  return text;
}

std::string FileError::text() const { return file.string() + ": " + error_text(error); }

std::optional<FileError> replace_file(const std::filesystem::path& path, std::string_view text,
                                      const Replacing& how) {
  const std::filesystem::path temporary = path.string() + ".tmp";
  File file(temporary, O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW, how.mode);
  if (!file.is_open()) return FileError{temporary, errno};
  const auto failed = [&](const std::filesystem::path& at) {
    const int error = errno;
    ::unlink(temporary.c_str());
    return FileError{at, error};
  };
  if (how.prepare) how.prepare(file.fd());
  const bool written = file.write(text.data(), text.size()) && (!how.wait_for_disk || file.sync());
  if (!written || !file.close()) return failed(temporary);
  if (::rename(temporary.c_str(), path.c_str()) != 0) return failed(path);
  if (how.wait_for_disk && !sync_folder(path.parent_path())) {
    return FileError{path.parent_path(), errno};
  }
  return std::nullopt;
}

bool sync_folder(const std::filesystem::path& folder) noexcept {
  const File handle(folder.empty() ? std::filesystem::path(".") : folder, O_RDONLY | O_DIRECTORY);
  return handle.is_open() && ::fsync(handle.fd()) == 0;
}

std::string error_text(int error) { return std::generic_category().message(error); }

}  // namespace loopwarden::base
