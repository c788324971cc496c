// SPDX-License-Identifier: Apache-2.0
#include "workbench/command_line/command_line.hpp"
#include "workbench/files/installed_files.hpp"

#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace installed_files_test {

using loopwarden::tests::TemporaryFolder;
using loopwarden::workbench::installed;
using loopwarden::workbench::look_in_package;
namespace fs = std::filesystem;

namespace {

void write(const fs::path& path) {
  fs::create_directories(path.parent_path());
  std::ofstream(path) << "here\n";
}

}  // namespace

TEST_CASE("Files of the source tree are found at their place in the package") {
  const TemporaryFolder share;
  const std::string root = share.path().string();
  write(share / "loopwarden/some-data/record.csv");
  write(share / "doc/loopwarden/examples/some-models/plant.yaml");
  CHECK(installed("examples/some-data/record.csv", root) ==
        root + "/loopwarden/some-data/record.csv");
  CHECK(installed("./examples/some-data", root) == root + "/loopwarden/some-data");
  CHECK(installed("examples/some-models/plant.yaml", root) ==
        root + "/doc/loopwarden/examples/some-models/plant.yaml");
  // A file outside the package, or with another prefix, keeps its name for the message.
  CHECK(installed("examples/some-data/other.csv", root) == "examples/some-data/other.csv");
  CHECK(installed("some-data/record.csv", root) == "some-data/record.csv");
  CHECK(installed("/examples/some-data/record.csv", root) == "/examples/some-data/record.csv");
  CHECK(installed("", root).empty());
}

TEST_CASE("The documents name only state folders that the packages have") {
  const auto text_of = [](const fs::path& path) {
    std::ifstream in(path);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  std::string taken_at_purge;
  for (const auto& file : fs::directory_iterator(LOOPWARDEN_SOURCE_DIR "/debian")) {
    if (file.path().extension() == ".postrm") taken_at_purge += text_of(file.path()) + " ";
  }
  const std::regex folder("/var/lib/loopwarden[a-z-]*");
  std::size_t named = 0;
  for (const auto& file : fs::recursive_directory_iterator(LOOPWARDEN_SOURCE_DIR "/docs")) {
    if (file.path().extension() != ".md" && file.path().extension() != ".scd") continue;
    const std::string text = text_of(file.path());
    for (std::sregex_iterator it(text.begin(), text.end(), folder), end; it != end; ++it) {
      INFO(file.path() << ": " << it->str());
      const std::regex whole(it->str() + "[ ;\n]");
      CHECK(std::regex_search(taken_at_purge, whole));
      ++named;
    }
  }
  CHECK(named > 5);
}

TEST_CASE("An existing file takes precedence over the package's") {
  const TemporaryFolder share;
  const TemporaryFolder here;
  write(share / "loopwarden/some-data/record.csv");
  write(here / "examples/some-data/record.csv");
  const fs::path before = fs::current_path();
  fs::current_path(here.path());
  const std::string found = installed("examples/some-data/record.csv", share.path().string());
  fs::current_path(before);
  CHECK(found == "examples/some-data/record.csv");
}

TEST_CASE("The package has the files under their names before the move to examples/ too") {
  const TemporaryFolder share;
  write(share / "loopwarden/some-data/record.csv");
  write(share / "doc/loopwarden/examples/models/plant1.yaml");
  CHECK(installed("data/some-data/record.csv", share.path().string()) ==
        (share / "loopwarden/some-data/record.csv").string());
  CHECK(installed("config/examples/models/plant1.yaml", share.path().string()) ==
        (share / "doc/loopwarden/examples/models/plant1.yaml").string());
}

TEST_CASE("Input files are searched in the package, output files are not") {
  const TemporaryFolder share;
  write(share / "loopwarden/some-data/record.csv");
  write(share / "loopwarden/some-data/model.yaml");
  std::string record;
  std::string model;
  std::string out;
  CLI::App app("test");
  CLI::App* sub = app.add_subcommand("gap");
  sub->add_option("record", record);
  sub->add_option("--model", model);
  sub->add_option("--out", out);
  look_in_package(app, share.path().string());
  app.parse(
      "gap examples/some-data/record.csv --model examples/some-data/model.yaml --out "
      "examples/some-data");
  CHECK(record == (share / "loopwarden/some-data/record.csv").string());
  CHECK(model == (share / "loopwarden/some-data/model.yaml").string());
  CHECK(out == "examples/some-data");
}

TEST_CASE("Documents of the package link only to its own files") {
  const TemporaryFolder tree;
  const fs::path source = LOOPWARDEN_SOURCE_DIR;
  const fs::path share = tree / "usr/share";
  for (const char* name : {"gap-example", "specialists"}) {
    fs::create_directories(share / "loopwarden");
    fs::copy(source / "examples" / name, share / "loopwarden" / name, fs::copy_options::recursive);
  }
  fs::create_directories(share / "loopwarden/measured");
  for (const char* name : {"measured/gap", "measured/README.md"}) {
    fs::copy(source / "examples" / name, share / "loopwarden" / name, fs::copy_options::recursive);
  }
  const std::string command =
      (source / "tools/installed-documents").string() + " " + tree.path().string();
  REQUIRE(std::system(command.c_str()) == 0);
  CHECK(fs::exists(share / "doc/loopwarden/docs/tutorials/find-a-model-error.md"));
  std::size_t links = 0;
  for (const auto& entry : fs::recursive_directory_iterator(share)) {
    if (entry.path().extension() != ".md") continue;
    std::ifstream in(entry.path());
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    const std::regex link(R"(\]\(([^)#\s]+))");
    for (std::sregex_iterator at(text.begin(), text.end(), link), end; at != end; ++at) {
      const std::string target = (*at)[1];
      if (target.starts_with("http")) continue;
      ++links;
      INFO(entry.path() << ": " << target);
      CHECK(fs::exists(entry.path().parent_path() / target));
    }
  }
  CHECK(links > 30);
}

}  // namespace installed_files_test
