// SPDX-License-Identifier: Apache-2.0
#include "daemon/recorder/flash_memory.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace loopwarden::daemon::flash_memory_test {
namespace {

namespace fs = std::filesystem;

// Makes the kernel's folder of the disk with `folder`, which is a partition of `name`.
fs::path devices_with(const fs::path& folder, const std::string& name, const char* rotational,
                      const char* removable) {
  struct stat status {};
  REQUIRE(::stat(folder.c_str(), &status) == 0);
  const fs::path disk = folder / "sys" / name;
  tests::write_file(disk / "queue" / "rotational", rotational);
  tests::write_file(disk / "removable", removable);
  tests::write_file(disk / "part1" / "partition", "1");
  fs::create_directory_symlink(
      disk / "part1",
      folder / "sys" / fmt::format("{}:{}", major(status.st_dev), minor(status.st_dev)));
  return folder / "sys";
}

bool flash(const std::string& name, const char* rotational, const char* removable) {
  const tests::TemporaryFolder folder;
  return is_on_flash(folder.path(), devices_with(folder.path(), name, rotational, removable));
}

TEST_CASE("SD cards, SSDs and removable disks are flash memory; other disks are not") {
  CHECK(flash("mmcblk0", "1\n", "0\n"));
  CHECK(flash("nvme0n1", "0\n", "0\n"));
  CHECK(flash("sda", "1\n", "1\n"));
  CHECK_FALSE(flash("sda", "1\n", "0\n"));
}

TEST_CASE("an unknown device or a missing folder is not flash memory") {
  const tests::TemporaryFolder folder;
  CHECK_FALSE(is_on_flash(folder.path(), folder / "none"));
  CHECK_FALSE(is_on_flash(folder / "missing", folder.path()));
}

}  // namespace
}  // namespace loopwarden::daemon::flash_memory_test
