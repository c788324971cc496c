// SPDX-License-Identifier: Apache-2.0
#include "daemon/recorder/flash_memory.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <optional>
#include <string>
#include <system_error>

#include "base/file.hpp"

namespace loopwarden::daemon {
namespace {

namespace fs = std::filesystem;

bool has_value(const fs::path& file, char value) {
  const std::optional<std::string> text = base::read_file(file, 16);
  return text && text->starts_with(value);
}

}  // namespace

bool is_on_flash(const fs::path& path, const fs::path& devices) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return false;
  std::error_code error;
  fs::path device = fs::canonical(
      devices / fmt::format("{}:{}", major(status.st_dev), minor(status.st_dev)), error);
  if (error) return false;
  // The folder of a partition is in that of its disk.
  if (fs::exists(device / "partition", error)) device = device.parent_path();
  return device.filename().string().starts_with("mmcblk") ||
         has_value(device / "queue" / "rotational", '0') || has_value(device / "removable", '1');
}

}  // namespace loopwarden::daemon
