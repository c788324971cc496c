// SPDX-License-Identifier: Apache-2.0
#include "config/source_file.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <fstream>
#include <system_error>

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
  // A FIFO or a terminal would block; a directory has no bytes.
  if (!fs::is_regular_file(status)) {
    report.error({}, "", "is not a regular file");
    return std::nullopt;
  }
  std::ifstream stream(path, std::ios::binary);
  std::string text(kMostFileBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (stream.bad() || (stream.fail() && !stream.eof())) {
    report.error({}, "", fmt::format("can't be read: {}", std::generic_category().message(errno)));
    return std::nullopt;
  }
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (text.size() > kMostFileBytes) {
    report.error({}, "", fmt::format("is larger than {} bytes", kMostFileBytes));
    return std::nullopt;
  }
  return text;
}

fs::path resolve(const std::string& referring_file, const std::string& path) {
  return (fs::path(referring_file).parent_path() / path).lexically_normal();
}

}  // namespace loopwarden::config
