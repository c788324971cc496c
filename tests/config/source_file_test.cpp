// SPDX-License-Identifier: Apache-2.0
#include "config/source_file.hpp"

#include <sys/stat.h>

#include "tests/config/config_support.hpp"

namespace source_file_test {

using namespace loopwarden::config;
using test::ScratchFolder;

TEST_CASE("Only regular files of sane size are read", "[config]") {
  const ScratchFolder folder;
  Report report("f");

  folder.write("good", "a: 1\n");
  CHECK(read_source_file(folder.path() / "good", report) == "a: 1\n");
  CHECK_FALSE(report.has_errors());

  CHECK_FALSE(read_source_file(folder.path() / "absent", report));
  CHECK(to_text(report.take()) == "f: error: can't be read: No such file or directory\n");

  CHECK_FALSE(read_source_file(folder.path(), report));
  CHECK(to_text(report.take()) == "f: error: is not a regular file\n");

  // A pipe without a writer would block the reader for ever.
  REQUIRE(mkfifo((folder.path() / "pipe").c_str(), 0600) == 0);
  CHECK_FALSE(read_source_file(folder.path() / "pipe", report));
  CHECK(to_text(report.take()) == "f: error: is not a regular file\n");

  folder.write("most", std::string(kMostFileBytes, '#'));
  CHECK(read_source_file(folder.path() / "most", report));
  folder.write("large", std::string(kMostFileBytes + 1, '#'));
  CHECK_FALSE(read_source_file(folder.path() / "large", report));
  CHECK(to_text(report.take()) == "f: error: is larger than 1048576 bytes\n");
}

TEST_CASE("Paths in a file start from its folder", "[config]") {
  CHECK(resolve("conf/loops.d/a.yaml", "../models/m.yaml") == "conf/models/m.yaml");
  CHECK(resolve("conf/loops.d/a.yaml", "/srv/m.yaml") == "/srv/m.yaml");
  CHECK(resolve("a.yaml", "m.yaml") == "m.yaml");
}

}  // namespace source_file_test
