// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/setups.hpp"

#include <catch2/catch.hpp>
#include <fcntl.h>
#include <sys/stat.h>

#include <string>

#include "base/file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::daemon::console::setups_test {
namespace {

struct Configuration {
  tests::TemporaryFolder folder;

  std::filesystem::path write(const std::string& name, const std::string& text) const {
    tests::write_file(folder / "setup" / name, text);
    return folder / "setup" / name;
  }
  std::vector<protocol::SetupUnderWay> setups() const { return setups_in(folder.path()).setups; }
};

// Locks the file as `loopwarden setup` does while it runs.
base::File held(const std::filesystem::path& path, short type = F_WRLCK) {
  base::File file(path, O_RDWR);
  struct flock lock {};
  lock.l_type = type;
  lock.l_whence = SEEK_SET;
  REQUIRE(::fcntl(file.fd(), F_OFD_SETLK, &lock) == 0);
  return file;
}

constexpr const char* kAtDevices =
    R"({"answers": {"tag": "FIC-101"}, "steps": {"loop": "done", "masters": "left"}, "found": {},
        "begun_ms": 1000, "now_at": "devices", "now_at_since_ms": 2000})";

std::string all_done() {
  std::string steps;
  for (const auto& step : protocol::kSetupSteps) {
    steps += (steps.empty() ? "\"" : ", \"") + std::string(step.name) + R"(": "done")";
  }
  return R"({"answers": {}, "found": {}, "steps": {)" + steps + "}}";
}

}  // namespace

TEST_CASE("without a setup the list is empty", "[setups]") {
  const Configuration configuration;
  CHECK(configuration.setups().empty());
  std::filesystem::create_directory(configuration.folder / "setup");
  CHECK(configuration.setups().empty());
}

TEST_CASE("a setup has the steps of its file", "[setups]") {
  const Configuration configuration;
  configuration.write("FIC-101.json", kAtDevices);
  const auto setups = configuration.setups();
  REQUIRE(setups.size() == 1);
  CHECK(setups[0].loop == "FIC-101");
  CHECK(setups[0].begun_ms == 1000);
  CHECK(setups[0].command ==
        "loopwarden setup FIC-101 --config " + configuration.folder.path().string());
  REQUIRE(setups[0].steps.size() == protocol::kSetupSteps.size());
  CHECK(setups[0].steps[0].name == "loop");
  CHECK(setups[0].steps[0].title == "the loop");
  CHECK(setups[0].steps[0].state == "done");
  for (std::size_t i = 1; i < setups[0].steps.size(); ++i) {
    CHECK(setups[0].steps[i].state == "open");
    CHECK_FALSE(setups[0].steps[i].since_ms);
  }
}

TEST_CASE("a step is running while the program that writes the file exists", "[setups]") {
  const Configuration configuration;
  const auto file = configuration.write("FIC-101.json", kAtDevices);
  {
    const base::File by_setup = held(file);
    const auto setups = configuration.setups();
    REQUIRE(setups.size() == 1);
    CHECK(setups[0].steps[0].state == "done");
    CHECK(setups[0].steps[1].state == "running");
    CHECK(setups[0].steps[1].since_ms == 2000);
    CHECK(setups[0].steps[2].state == "open");
  }
  // Killed. A lock for reading doesn't count: any user may take it.
  const base::File by_reader = held(file, F_RDLCK);
  CHECK(configuration.setups().at(0).steps[1].state == "open");
}

TEST_CASE("a finished setup is not listed any more", "[setups]") {
  const Configuration configuration;
  configuration.write("FIC-101.json", all_done());
  CHECK(configuration.setups().empty());
}

TEST_CASE("a file that is no setup is not listed, and hides no other", "[setups]") {
  const Configuration configuration;
  constexpr std::size_t kTooMuch = 70'000;
  for (const char* text : {"", "{", "[]", "5", "{}", R"({"steps": 5})", R"({"steps": {"loop": 5}})",
                           R"({"steps": {}, "now_at": 5})"}) {
    INFO(text);
    configuration.write("broken.json", text);
    CHECK(configuration.setups().empty());
  }
  configuration.write("long.json", kAtDevices + std::string(kTooMuch, ' '));
  configuration.write("FIC-1;reboot.json", kAtDevices);
  configuration.write("-x.json", kAtDevices);
  configuration.write("FIC-101.json.tmp", kAtDevices);
  const auto elsewhere = configuration.folder / "elsewhere.json";
  tests::write_file(elsewhere, kAtDevices);
  std::filesystem::create_symlink(elsewhere, configuration.folder / "setup/link.json");
  std::filesystem::create_directory(configuration.folder / "setup/folder.json");
  REQUIRE(::mkfifo((configuration.folder / "setup/pipe.json").c_str(), 0600) == 0);
  CHECK(configuration.setups().empty());
  configuration.write("FIC-102.json", R"({"steps": {"new step": "done"}, "begun_ms": "now"})");
  const auto setups = configuration.setups();
  REQUIRE(setups.size() == 1);
  CHECK(setups[0].loop == "FIC-102");
  CHECK_FALSE(setups[0].begun_ms);
}

TEST_CASE("the command for a folder with odd characters is valid in a shell", "[setups]") {
  const Configuration configuration;
  const auto odd = configuration.folder / "plant's files";
  tests::write_file(odd / "setup/FIC-101.json", kAtDevices);
  const auto setups = setups_in(odd).setups;
  REQUIRE(setups.size() == 1);
  CHECK(setups[0].command == "loopwarden setup FIC-101 --config '" +
                                 configuration.folder.path().string() + "/plant'\\''s files'");
}

TEST_CASE("only some of many setups are listed", "[setups]") {
  const Configuration configuration;
  for (int i = 100; i < 150; ++i) {
    configuration.write("FIC-" + std::to_string(i) + ".json", kAtDevices);
  }
  const auto setups = configuration.setups();
  CHECK(setups.size() == 32);
  CHECK(setups.front().loop == "FIC-100");
}

}  // namespace loopwarden::daemon::console::setups_test
