// SPDX-License-Identifier: Apache-2.0
// What `loopwarden check` prints about a file.
#include <catch2/catch.hpp>
#include <string>

#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::check_command_test {

TEST_CASE("errors come before warnings, whatever their lines are", "[check]") {
  const TemporaryFolder folder;
  std::string loop = read_file(LOOPWARDEN_SOURCE_DIR "/examples/watch-mqtt/loops.d/FIC-206.yaml");
  loop.replace(loop.find("loop: FIC-206"), 13, "loop: pump");
  write_file(folder / "pump.yaml", loop + "\nno_such_key: 1\n");
  const ShellOutcome out =
      run(LOOPWARDEN_CLI " check " + (folder / "pump.yaml").string() + " 2>&1");
  const std::size_t error = out.text.find("error: unknown key 'no_such_key'");
  const std::size_t warning = out.text.find("warning: loop: 'pump' is no tag");
  REQUIRE(error != std::string::npos);
  REQUIRE(warning != std::string::npos);
  CHECK(error < warning);
}

}  // namespace loopwarden::tests::check_command_test
