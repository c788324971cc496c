// SPDX-License-Identifier: Apache-2.0
#include "base/secret/secret.hpp"

#include <catch2/catch.hpp>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace secret_test {

using loopwarden::base::read_secret;

TEST_CASE("a secret is the first line of a credential or of a file", "[secret]") {
  const loopwarden::tests::TemporaryFolder folder;
  loopwarden::tests::write_file(folder / "password", "geheim\r\nnot this\n");
  loopwarden::tests::write_file(folder / "empty", "\n");
  CHECK(read_secret({.credential = {}, .file = folder / "password"}) == "geheim");
  CHECK_THROWS_AS(read_secret({.credential = {}, .file = folder / "empty"}), std::runtime_error);
  CHECK_THROWS_AS(read_secret({.credential = {}, .file = folder / "none"}), std::runtime_error);
  loopwarden::tests::write_file(folder / "longest", std::string(4096, 'a'));
  CHECK(read_secret({.credential = {}, .file = folder / "longest"}).size() == 4096);
  loopwarden::tests::write_file(folder / "longer", std::string(4097, 'a') + "\n");
  CHECK_THROWS_AS(read_secret({.credential = {}, .file = folder / "longer"}), std::runtime_error);
  ::unsetenv("CREDENTIALS_DIRECTORY");
  CHECK_THROWS_WITH(read_secret({.credential = "password", .file = {}}),
                    Catch::Contains("LoadCredential"));
  ::setenv("CREDENTIALS_DIRECTORY", folder.path().c_str(), 1);
  CHECK(read_secret({.credential = "password", .file = {}}) == "geheim");
  ::unsetenv("CREDENTIALS_DIRECTORY");
}

}  // namespace secret_test
