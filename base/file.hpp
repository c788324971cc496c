// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <utility>

namespace loopwarden::base {

// A file descriptor that closes itself.
class File {
 public:
  File() = default;
  // As open(2), close-on-exec. Not open, with the reason in errno, if that failed.
  File(const std::filesystem::path& path, int flags, unsigned mode = 0640) noexcept;
  File(File&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  File& operator=(File&& other) noexcept;
  ~File() { close(); }

  bool is_open() const noexcept { return fd_ >= 0; }
  int fd() const noexcept { return fd_; }
  // False, with the reason in errno, if the last write turns out to have failed.
  bool close() noexcept;

  // All bytes, or false with the reason in errno.
  bool write(const void* data, std::size_t size) noexcept;
  bool write_at(const void* data, std::size_t size, std::size_t offset) noexcept;
  // Waits until the disk has the data.
  bool sync() noexcept;

 private:
  int fd_ = -1;
};

// Makes new and removed names of a folder survive a power failure.
bool sync_folder(const std::filesystem::path& folder) noexcept;

// What errno says, in words.
std::string error_text(int error);

}  // namespace loopwarden::base
