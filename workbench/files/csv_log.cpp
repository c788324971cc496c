// SPDX-License-Identifier: Apache-2.0
#include "workbench/files/csv_log.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "base/file.hpp"
#include "base/text.hpp"
#include "workbench/files/command_error.hpp"

namespace loopwarden::workbench {

void fail_csv(const std::filesystem::path& path, const char* what, int error) {
  throw CommandError(kExitIo,
                     fmt::format("{}: {}: {}", path.string(), what, base::error_text(error)));
}

void append_csv_line(const std::filesystem::path& path, const std::string& header,
                     const std::string& line) {
  base::File file(path, O_RDWR | O_CREAT | O_APPEND, 0666);
  if (!file.is_open() || ::flock(file.fd(), LOCK_EX) != 0)
    fail_csv(path, "can't be written", errno);
  struct stat before {};
  if (::fstat(file.fd(), &before) != 0) fail_csv(path, "can't be read", errno);
  std::string text = header + "\n";
  if (before.st_size > 0) {
    std::string found(text.size(), '\0');
    if (::pread(file.fd(), found.data(), found.size(), 0) != static_cast<ssize_t>(found.size()) ||
        found != text) {
      throw CommandError(kExitData,
                         fmt::format("{}:1:1: must begin with the line {}; was it saved by a "
                                     "spreadsheet? Save it with commas, the columns as they were",
                                     path.string(), base::in_quotes(header)));
    }
    char last = '\0';
    const bool whole = ::pread(file.fd(), &last, 1, before.st_size - 1) == 1 && last == '\n';
    text = whole ? "" : "\n";
  }
  text += line + "\n";
  if (!file.write(text.data(), text.size()) || !file.sync()) {
    const int error = errno;
    if (::ftruncate(file.fd(), before.st_size) != 0)
      fail_csv(path, "is left with half a line", errno);
    fail_csv(path, "can't be written", error);
  }
  base::sync_folder(path.parent_path());
}

}  // namespace loopwarden::workbench
