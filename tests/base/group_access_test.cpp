// SPDX-License-Identifier: Apache-2.0
#include "base/group_access.hpp"

#include <grp.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <string>

#include <catch2/catch.hpp>

#include "base/local_address.hpp"
#include "base/local_server.hpp"
#include "tests/support/temporary_folder.hpp"

namespace group_access_test {

using namespace loopwarden::base;
using loopwarden::tests::TemporaryFolder;

namespace {

constexpr unsigned kStranger = 54'321;  // a user id and a group id that don't exist
constexpr unsigned kGroup = 54'322;

// Returns whether a user with only this group reaches the socket. Needs root.
bool reaches(const std::string& path, unsigned group) {
  const pid_t child = fork();
  if (child == 0) {
    const bool other = setgroups(0, nullptr) == 0 && setgid(group) == 0 && setuid(kStranger) == 0;
    _exit(other && try_local_connection(path) >= 0 ? 0 : 1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace

TEST_CASE("groups are found by their names", "[os][socket]") {
  CHECK(group_id("root") == 0U);
  CHECK_FALSE(group_id("no-such-group-anywhere"));
}

TEST_CASE("a missing file can't admit a group", "[os][socket]") {
  CHECK_FALSE(admit_group("/no/such/file", kGroup, {.read = true}));
}

TEST_CASE("a group reaches the socket that it is admitted to, and no other", "[os][socket]") {
  if (geteuid() != 0) {
    WARN("needs root, to be somebody else");
    return;
  }
  TemporaryFolder folder;
  // mkdtemp made the folder only for its owner. The group can pass through it, and can't list it.
  LocalServer server;
  const auto handler = [](std::string_view line, unsigned) { return std::string(line); };
  server.listen({.path = (folder / "page.sock").string(), .group = kGroup}, handler);
  server.listen({.path = (folder / "control.sock").string()}, handler);
  if (!admit_group((folder / "page.sock").string(), kGroup, {.read = true, .write = true})) {
    WARN("this file system has no access control lists");
    return;
  }
  CHECK(reaches((folder / "page.sock").string(), kGroup));
  CHECK_FALSE(reaches((folder / "control.sock").string(), kGroup));
  CHECK_FALSE(reaches((folder / "page.sock").string(), kStranger));
  // Again with fewer rights: rights are set, not added.
  CHECK(admit_group((folder / "page.sock").string(), kGroup, {.read = true}));
  CHECK_FALSE(reaches((folder / "page.sock").string(), kGroup));
  struct stat status {};
  REQUIRE(stat(folder.path().c_str(), &status) == 0);
  CHECK((status.st_mode & 07U) == 0U);
}

}  // namespace group_access_test
