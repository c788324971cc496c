// SPDX-License-Identifier: Apache-2.0
#include "base/file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace file_test {

using namespace loopwarden::base;
using loopwarden::tests::TemporaryFolder;
using loopwarden::tests::write_file;

TEST_CASE("a file is read completely, or the reason is given", "[file]") {
  const TemporaryFolder folder;
  const std::string large(200'000, 'x');
  write_file(folder / "large", large);
  write_file(folder / "empty", "");
  CHECK(read_file(folder / "large") == large);
  CHECK(read_file(folder / "large", large.size()) == large);
  CHECK(read_file(folder / "empty", 0) == "");
  CHECK_FALSE(read_file(folder / "large", large.size() - 1));
  CHECK(errno == EFBIG);
  CHECK_FALSE(read_file(folder / "none"));
  CHECK(errno == ENOENT);
  CHECK_FALSE(read_file(folder.path()));
  CHECK(errno == EISDIR);
}

TEST_CASE("data that arrives in parts through a pipe is read to its end", "[file]") {
  std::array<int, 2> ends{};
  REQUIRE(::pipe(ends.data()) == 0);
  const File from(ends[0]);
  File to(ends[1]);
  REQUIRE(to.write("abc", 3));
  REQUIRE(to.write("def", 3));
  REQUIRE(to.close());
  CHECK(from.read(4) == "abcd");
  CHECK(from.read(100) == "ef");
  CHECK(from.read(100) == "");
}

TEST_CASE("a file is replaced atomically", "[file]") {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder / "file";
  for (const std::string text : {"first", "second, longer", ""}) {
    CHECK_FALSE(replace_file(path, text, {.mode = 0600}));
    CHECK(read_file(path) == text);
  }
  struct stat status {};
  REQUIRE(::stat(path.c_str(), &status) == 0);
  CHECK((status.st_mode & 07777U) == 0600U);
  CHECK_FALSE(std::filesystem::exists(folder / "file.tmp"));
  CHECK_FALSE(replace_file(path, "x", {.wait_for_disk = false, .prepare = [](int fd) {
                                         REQUIRE(::fchmod(fd, 0604) == 0);
                                       }}));
  REQUIRE(::stat(path.c_str(), &status) == 0);
  CHECK((status.st_mode & 07777U) == 0604U);
}

TEST_CASE("a file that can't be replaced stays, without other files", "[file]") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "taken");
  write_file(folder / "taken" / "file", "x");
  const auto error = replace_file(folder / "taken", "text");
  REQUIRE(error);
  CHECK(error->file == folder / "taken");
  CHECK(error->text() == (folder / "taken").string() + ": " + error_text(error->error));
  CHECK_FALSE(std::filesystem::exists(folder / "taken.tmp"));
  const auto none = replace_file(folder / "none" / "file", "text");
  REQUIRE(none);
  CHECK(none->file == folder / "none" / "file.tmp");
  CHECK(none->error == ENOENT);
  // A link in place of the temporary file is not followed.
  std::filesystem::create_symlink(folder / "taken" / "file", folder / "linked.tmp");
  REQUIRE(replace_file(folder / "linked", "text"));
  CHECK(read_file(folder / "taken" / "file") == "x");
}

}  // namespace file_test
