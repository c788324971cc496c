// SPDX-License-Identifier: Apache-2.0
// Related files: the order of their renames, and the data on disk at each rename.
#include "workbench/files/output_files.hpp"

#include <catch2/catch.hpp>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.hpp"
#include "tests/workbench/files/watched_disk.hpp"

namespace loopwarden::tests::output_files_test {
namespace {

namespace fs = std::filesystem;
using workbench::OutputFiles;
using Kind = DiskCall::Kind;

std::vector<std::string> names_in(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) names.insert(entry.path().lexically_relative(folder).string());
  }
  return {names.begin(), names.end()};
}

}  // namespace

TEST_CASE("files are renamed in the order in which they were added", "[output_files]") {
  const TemporaryFolder folder;
  std::vector<std::string> names;
  OutputFiles files;
  files.expect(folder / "z.json");
  files.expect(folder / "never");
  files.make_folder(folder / "sub");
  files.add(folder / "sub/b", "1");
  files.add(folder / "a", "2");
  files.add(folder / "z.json", "3");
  {
    const WatchedDisk disk([&](const DiskCall& call) {
      if (call.kind == Kind::rename) {
        names.push_back(call.to.lexically_relative(folder.path()).string());
      }
    });
    files.commit();
  }
  CHECK(names == std::vector<std::string>{"sub/b", "a", "z.json"});
  CHECK(names_in(folder.path()) == std::vector<std::string>{"a", "sub/b", "z.json"});
}

TEST_CASE("the disk has all data before the first name, and all names before the last",
          "[output_files]") {
  const TemporaryFolder folder;
  OutputFiles files;
  files.make_folder(folder / "sub");
  const std::vector<fs::path> added{folder / "sub/a", folder / "sub/b", folder / "c", folder / "d"};
  for (const fs::path& path : added) files.add(path, "text");
  std::vector<DiskCall> calls;
  {
    const WatchedDisk disk([&](const DiskCall& call) { calls.push_back(call); });
    files.commit();
  }
  std::set<fs::path> synced;
  std::set<fs::path> open;  // folders with names that may not be on the disk yet
  std::size_t named = 0;
  for (const DiskCall& call : calls) {
    if (call.kind == Kind::sync) {
      synced.insert(call.path);
      open.erase(call.path);
      continue;
    }
    INFO(call.to.string());
    CHECK(synced.contains(call.path));
    open.erase(call.to.parent_path());
    CHECK(open.empty());
    if (++named == added.size()) {
      CHECK(calls[calls.size() - 1].kind == Kind::sync);
      CHECK((&call - 1)->kind == Kind::sync);
    }
    open.insert(call.to.parent_path());
  }
  CHECK(named == added.size());
  CHECK(open.empty());
}

TEST_CASE("after a kill between two renames the first names are complete", "[output_files]") {
  const TemporaryFolder folder;
  const auto text = [&](const char* name) { return read_file(folder / name); };
  const std::size_t renames = kill_at_every_rename(
      [&] {
        for (const char* name : {"link", "loop"}) write_file(folder / name, "old");
      },
      [&] {
        OutputFiles files;
        files.add(folder / "link", "new");
        files.add(folder / "loop", "new");
        files.commit();
      },
      [&](std::size_t given) {
        CHECK(text("link") == (given > 0 ? "new" : "old"));
        CHECK(text("loop") == (given > 1 ? "new" : "old"));
      });
  CHECK(renames == 2);
}

TEST_CASE("a failed rename undoes the earlier ones", "[output_files]") {
  const TemporaryFolder folder;
  write_file(folder / "a", "old");
  OutputFiles files;
  files.make_folder(folder / "sub");
  files.add(folder / "a", "new");
  files.add(folder / "b", "new");
  files.add(folder / "sub/c", "new");
  {
    const WatchedDisk disk([&](const DiskCall& call) {
      // A folder has the name of the file.
      if (call.kind == Kind::rename && call.to == folder / "b") {
        fs::create_directory(folder / "sub/c");
        write_file(folder / "sub/c/x", "");
      }
    });
    CHECK_THROWS_AS(files.commit(), workbench::OutputError);
  }
  CHECK(read_file(folder / "a") == "old");
  CHECK_FALSE(fs::exists(folder / "b"));
}

}  // namespace loopwarden::tests::output_files_test
