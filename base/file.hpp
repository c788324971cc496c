// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace loopwarden::base {

// A file descriptor that closes itself.
class File {
 public:
  File() = default;
  // Opens as open(2), close-on-exec. If that fails, the file is not open and errno has the reason.
  File(const std::filesystem::path& path, int flags, unsigned mode = 0640) noexcept;
  // Takes over an open descriptor; -1: not open.
  explicit File(int fd) noexcept : fd_(fd) {}
  File(File&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  File& operator=(File&& other) noexcept;
  ~File() { close(); }

  bool is_open() const noexcept { return fd_ >= 0; }
  int fd() const noexcept { return fd_; }
  // Returns false, with the reason in errno, if the last write failed after all.
  bool close() noexcept;
  // The caller closes the descriptor.
  int release() noexcept { return std::exchange(fd_, -1); }

  // Reads from the present position to the end, at most `most_bytes`. Returns nullopt, with the
  // reason in errno, if it can't be read.
  std::optional<std::string> read(std::size_t most_bytes) const;
  // Write all bytes, or return false with the reason in errno.
  bool write(const void* data, std::size_t size) noexcept;
  bool write_at(const void* data, std::size_t size, std::size_t offset) noexcept;
  // Waits until the disk has the data.
  bool sync() noexcept;

 private:
  int fd_ = -1;
};

// Returns all bytes of a file; nullopt, with the reason in errno, if it can't be read. EFBIG: it
// has more than `most_bytes`.
std::optional<std::string> read_file(const std::filesystem::path& path,
                                     std::size_t most_bytes = std::size_t{1} << 30U);

struct FileError {
  std::filesystem::path file;
  int error = 0;             // as errno
  std::string text() const;  // "FILE: reason"
};

struct Replacing {
  unsigned mode = 0640;  // as for open(2)
  // If false, a power failure soon afterwards may leave an empty file.
  bool wait_for_disk = true;
  // Called before the first write, to set owner or permissions; may throw.
  std::function<void(int fd)> prepare{};
};

// Replaces a file completely or not at all: writes PATH.tmp, waits until the disk has it, renames
// it and waits for the folder. Returns the step that failed; nullopt on success.
std::optional<FileError> replace_file(const std::filesystem::path& path, std::string_view text,
                                      const Replacing& how = {});

// Waits until new and removed names of a folder survive a power failure.
bool sync_folder(const std::filesystem::path& folder) noexcept;

// Returns the description of an errno value.
std::string error_text(int error);

}  // namespace loopwarden::base
