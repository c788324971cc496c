// SPDX-License-Identifier: Apache-2.0
#include "services/page/users/user_file.hpp"

#include <catch2/catch.hpp>
#include <sys/stat.h>

#include "services/page/users/password.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::user_file_test {

using namespace page;

std::string trouble(const std::string& text) {
  try {
    parse_users(text, "users");
    return "none";
  } catch (const UserFileError& e) {
    return e.what();
  }
}

const std::string& hash() {
  static const std::string one = hash_password("correct horse", PasswordCost::least);
  return one;
}

TEST_CASE("a users file that is written reads back the same") {
  const TemporaryFolder folder;
  const Users users{{"anna", {Role::operator_, hash()}},
                    {"ben", {Role::viewer, hash()}},
                    {"wall", {Role::viewer, hash(), true}}};
  write_users(users, folder / "users");
  const Users again = read_users(folder / "users");
  REQUIRE(again.size() == 3);
  CHECK(again.at("wall").display);
  CHECK(again.at("wall").hash == hash());
  CHECK_FALSE(again.at("ben").display);
  CHECK(again.at("anna").role == Role::operator_);
  CHECK(again.at("anna").hash == hash());
  struct stat status {};
  ::stat((folder / "users").c_str(), &status);
  CHECK((status.st_mode & 0777U) == 0640);
}

TEST_CASE("errors name line and column") {
  CHECK(trouble("# a comment\n\nanna:viewer:" + hash() + "\n") == "none");
  CHECK(trouble("anna") == "users:1:1: error: expected name:role:hash");
  CHECK(trouble("\nanna:viewr:" + hash()) ==
        "users:2:6: error: expected viewer, operator or engineer (got 'viewr'); did you mean "
        "'viewer'?");
  CHECK(trouble("anna:viewer:secret") == "users:1:13: error: that is no hash by argon2id");
  CHECK(trouble("wall:viewer:" + hash() + ":display") == "none");
  CHECK_THAT(trouble("wall:viewer:" + hash() + ":dsplay"),
             Catch::EndsWith("error: expected display or the end of the line after the hash"));
  CHECK_THAT(trouble("wall:operator:" + hash() + ":display"),
             Catch::EndsWith("error: a display is a viewer"));
  CHECK(trouble("1a:viewer:" + hash()) == "users:1:1: error: that is no user name");
  CHECK(trouble("a:viewer:" + hash() + "\na:viewer:" + hash()) ==
        "users:2:1: error: user 'a' occurs twice");
}

TEST_CASE("the running page takes over a changed file and keeps the old users if it is broken") {
  const TemporaryFolder folder;
  UserDirectory directory(folder / "users");
  CHECK_FALSE(directory.refresh().empty());
  CHECK(directory.users()->empty());
  write_users({{"anna", {Role::viewer, hash()}}}, folder / "users");
  CHECK(directory.refresh().empty());
  CHECK(directory.users()->size() == 1);
  write_file(folder / "users", "nonsense");
  CHECK_FALSE(directory.refresh().empty());
  CHECK(directory.refresh().empty());
  CHECK(directory.users()->size() == 1);
  std::filesystem::remove(folder / "users");
  directory.refresh();
  CHECK(directory.users()->empty());
}

TEST_CASE("users of a directory are added to the file's, whose names win") {
  const TemporaryFolder folder;
  write_users({{"Anna", {Role::viewer, hash()}}}, folder / "users");
  UserDirectory directory(folder / "users");
  CHECK(directory.refresh().empty());
  CHECK(directory.is_in_file("anna"));
  CHECK_FALSE(directory.is_in_file("ben"));
  directory.admit("ben", Role::operator_, "uid=ben");
  directory.admit("anna", Role::engineer, "uid=anna");
  CHECK(directory.users()->size() == 2);
  CHECK(directory.users()->at("ben").directory);
  CHECK(directory.users()->at("Anna").role == Role::viewer);
  CHECK(directory.of_directory() == std::vector<std::string>{"ben"});
  write_users({{"ben", {Role::viewer, hash()}}}, folder / "users");
  CHECK(directory.refresh().empty());
  CHECK(directory.users()->size() == 1);
  CHECK_FALSE(directory.users()->at("ben").directory);
  directory.admit("cleo", Role::viewer, "uid=cleo");
  directory.dismiss("cleo");
  CHECK(directory.users()->size() == 1);
}

TEST_CASE("valid user names for journals and files") {
  CHECK(is_user_name("anna.b-2_x"));
  for (const char* name : {"", "2anna", "a b", "a:b", "a@b", "ann\xc3\xa4"})
    CHECK_FALSE(is_user_name(name));
  CHECK_FALSE(is_user_name(std::string(33, 'a')));
}

}  // namespace loopwarden::tests::user_file_test
