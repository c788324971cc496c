// SPDX-License-Identifier: Apache-2.0
#include "config/source_file.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <system_error>

#include "base/file.hpp"

namespace loopwarden::config {

namespace fs = std::filesystem;

std::optional<std::string> read_source_file(const fs::path& path, Report& report) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) {
    report.error({}, "",
                 fmt::format("can't be read: {}", error ? error.message() : "no such file"));
    return std::nullopt;
  }
  // Opening a FIFO or a terminal would block; a directory has no bytes.
  if (!fs::is_regular_file(status)) {
    report.error({}, "", "is not a regular file");
    return std::nullopt;
  }
  std::optional<std::string> text = base::read_file(path, kMostFileBytes);
  if (!text) {
    report.error({}, "",
                 errno == EFBIG ? fmt::format("is larger than {} bytes", kMostFileBytes)
                                : fmt::format("can't be read: {}", base::error_text(errno)));
  }
  return text;
}

fs::path resolve(const std::string& referring_file, const std::string& path) {
  return (fs::path(referring_file).parent_path() / path).lexically_normal();
}

}  // namespace loopwarden::config
