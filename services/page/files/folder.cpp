// SPDX-License-Identifier: Apache-2.0
#include "services/page/files/folder.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <memory>

#include "base/file.hpp"

namespace loopwarden::page::files {
namespace {

// Returns a file that may not be open. O_NONBLOCK: a FIFO must not block the thread.
base::File open_below(const std::filesystem::path& top, const std::vector<std::string>& parts,
                      int flags) {
  constexpr int kCommon = O_RDONLY | O_CLOEXEC | O_NONBLOCK;
  base::File place(top, kCommon | O_DIRECTORY);
  for (std::size_t i = 0; i < parts.size() && place.is_open(); ++i) {
    if (!is_sound_name(parts[i])) return {};
    const bool last = i + 1 == parts.size();
    place = base::File(::openat(place.fd(), parts[i].c_str(),
                                kCommon | O_NOFOLLOW | (last ? flags : O_DIRECTORY)));
  }
  return place;
}

std::optional<std::string> read_regular(const base::File& file, std::size_t most, bool whole) {
  struct stat status {};
  if (!file.is_open() || ::fstat(file.fd(), &status) != 0 || !S_ISREG(status.st_mode)) {
    return std::nullopt;
  }
  if (whole && static_cast<std::size_t>(status.st_size) > most) return std::nullopt;
  return file.read(most);
}

}  // namespace

bool is_sound_name(const std::string& name) noexcept {
  return !name.empty() && name.front() != '.' && std::none_of(name.begin(), name.end(), [](char c) {
    return c == '/' || static_cast<unsigned char>(c) < 0x20 || c == 0x7F;
  });
}

std::optional<std::string> Folder::read(const std::vector<std::string>& parts,
                                        std::size_t most_bytes) const {
  return read_regular(open_below(path_, parts, 0), most_bytes, true);
}

std::optional<std::string> Folder::read_start(const std::vector<std::string>& parts,
                                              std::size_t most_bytes) const {
  return read_regular(open_below(path_, parts, 0), most_bytes, false);
}

std::vector<std::string> Folder::list(const std::vector<std::string>& parts,
                                      std::size_t most) const {
  std::vector<std::string> names;
  base::File folder = open_below(path_, parts, O_DIRECTORY);
  if (!folder.is_open()) return names;
  const std::unique_ptr<DIR, int (*)(DIR*)> entries(::fdopendir(folder.fd()), ::closedir);
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
