// SPDX-License-Identifier: Apache-2.0
// Runs the generator as a user does.
#include <catch2/catch.hpp>
#include <string>

#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::generator_test {
namespace {

int generate(const std::string& options) {
  return bash(LOOPWARDEN_BIN_DIR "/loopwarden_hidden_cases " + options + " 2>/dev/null").exit_code;
}

}  // namespace

TEST_CASE("the generator's wrong usage ends with 64, unwritable output with 74", "[hidden_cases]") {
  const TemporaryFolder folder;
  const std::string out = (folder / "out").string();
  CHECK(generate("--help") == 0);
  CHECK(generate("--out " + out) == 64);
  CHECK(generate("--out " + out + " --seed 1 --kinds odd") == 64);
  CHECK(generate("--out /proc/none --seed 1 --count 1") == 74);
}

}  // namespace loopwarden::tests::generator_test
