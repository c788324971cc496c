// SPDX-License-Identifier: Apache-2.0
// bash completion of the services, as readline requests it.
#include <catch2/catch.hpp>
#include <string>

#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::services_test {

// Returns the completions of the last of WORDS, which follow loopwarden-PROGRAM.
std::string completed(const std::string& program, const std::string& words) {
  return bash("source " LOOPWARDEN_SOURCE_DIR
              "/workbench/completion/loopwarden; COMP_WORDS=(" LOOPWARDEN_BIN_DIR "/loopwarden-" +
              program + " " + words +
              "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _loopwarden_service; "
              "echo ${COMPREPLY[@]}")
      .text;
}

TEST_CASE("completion knows each service's options", "[completion]") {
  for (const char* program : {"page", "edge", "feed", "notify", "fleet"}) {
    CHECK(completed(program, "--che") == "--check\n");
    CHECK(completed(program, "--conf") == "--config\n");
  }
  CHECK(completed("notify", "--config x --te") == "--test\n");
  CHECK(completed("fleet", "--bro") == "--broker\n");
  CHECK(completed("fleet", "--broker \"\"") == "\n");
}

TEST_CASE("completion knows the page's commands, roles and users", "[completion]") {
  CHECK(completed("page", "us") == "user\n");
  CHECK(completed("page", "cert") == "certificate\n");
  CHECK(completed("page", "user re") == "remove\n");
  CHECK(completed("page", "certificate --h") == "--help --host\n");
  CHECK(completed("page", "user add otto --role o") == "operator\n");
  const TemporaryFolder folder;
  const std::string users = (folder / "users").string();
  for (const char* name : {"otto", "vera"}) {
    bash("echo correct horse battery | " LOOPWARDEN_BIN_DIR "/loopwarden-page user add " +
         std::string(name) + " --stdin --users " + users);
  }
  CHECK(completed("page", "user remove --users " + users + " v") == "vera\n");
  CHECK(completed("page", "user password --users " + users + " \"\"") == "otto vera\n");
}

TEST_CASE("completion of paths: configuration files, folders", "[completion]") {
  const TemporaryFolder folder;
  write_file(folder / "page.yaml", "control: false\n");
  const std::string path = (folder / "pa").string();
  for (const char* program : {"page", "edge", "feed", "notify", "fleet"}) {
    CHECK(completed(program, "--config " + path) == (folder / "page.yaml").string() + "\n");
  }
  CHECK(completed("page", "--site " + path) == "\n");
}

}  // namespace loopwarden::tests::services_test
