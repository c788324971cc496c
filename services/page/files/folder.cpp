// SPDX-License-Identifier: Apache-2.0
#include "services/page/files/folder.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <memory>
#include <utility>

namespace loopwarden::page::files {
namespace {

class Descriptor {
 public:
  explicit Descriptor(int fd) noexcept : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  int get() const noexcept { return fd_; }
  int release() noexcept { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

// -1 where it can't be had. O_NONBLOCK: a FIFO must not hold the thread.
Descriptor open_below(const std::filesystem::path& top, const std::vector<std::string>& parts,
                      int flags) {
  constexpr int kCommon = O_RDONLY | O_CLOEXEC | O_NONBLOCK;
  Descriptor place(::open(top.c_str(), kCommon | O_DIRECTORY));
  for (std::size_t i = 0; i < parts.size() && place.get() >= 0; ++i) {
    if (!is_sound_name(parts[i])) return Descriptor(-1);
    const bool last = i + 1 == parts.size();
    place = Descriptor(::openat(place.get(), parts[i].c_str(),
                                kCommon | O_NOFOLLOW | (last ? flags : O_DIRECTORY)));
  }
  return place;
}

std::optional<std::string> read_file(const Descriptor& file, std::size_t most, bool whole) {
  struct stat status {};
  if (file.get() < 0 || ::fstat(file.get(), &status) != 0 || !S_ISREG(status.st_mode)) {
    return std::nullopt;
  }
  const auto size = static_cast<std::size_t>(status.st_size);
  if (whole && size > most) return std::nullopt;
  std::string text(std::min(size, most), '\0');
  std::size_t got = 0;
  while (got < text.size()) {
    const ssize_t n = ::read(file.get(), text.data() + got, text.size() - got);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return std::nullopt;
    if (n == 0) break;
    got += static_cast<std::size_t>(n);
  }
  text.resize(got);
  return text;
}

}  // namespace

bool is_sound_name(const std::string& name) noexcept {
  return !name.empty() && name.front() != '.' && std::none_of(name.begin(), name.end(), [](char c) {
    return c == '/' || static_cast<unsigned char>(c) < 0x20 || c == 0x7F;
  });
}

std::optional<std::string> Folder::read(const std::vector<std::string>& parts,
                                        std::size_t most_bytes) const {
  return read_file(open_below(path_, parts, 0), most_bytes, true);
}

std::optional<std::string> Folder::read_start(const std::vector<std::string>& parts,
                                              std::size_t most_bytes) const {
  return read_file(open_below(path_, parts, 0), most_bytes, false);
}

std::vector<std::string> Folder::list(const std::vector<std::string>& parts,
                                      std::size_t most) const {
  std::vector<std::string> names;
  Descriptor folder = open_below(path_, parts, O_DIRECTORY);
  if (folder.get() < 0) return names;
  const std::unique_ptr<DIR, int (*)(DIR*)> entries(::fdopendir(folder.get()), ::closedir);
  if (!entries) return names;
  const int fd = folder.release();  // the stream has it now
  while (const dirent* entry = ::readdir(entries.get())) {
    struct stat status {};
    const bool regular =
        ::fstatat(fd, entry->d_name, &status, AT_SYMLINK_NOFOLLOW) == 0 && S_ISREG(status.st_mode);
    if (regular && is_sound_name(entry->d_name)) names.emplace_back(entry->d_name);
    if (names.size() >= most) break;
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace loopwarden::page::files
