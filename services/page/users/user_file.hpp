// SPDX-License-Identifier: Apache-2.0
// The users file: one line a user, name:role:hash, then :display for a wall display. Lines that begin with # and empty ones are left out.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "services/page/users/role.hpp"

namespace loopwarden::page {

struct User {
  Role role = Role::viewer;
  std::string hash;        // argon2id; of a directory's user his name there
  bool display = false;    // on a wall, where nobody touches it: no idle limit; a viewer
  bool directory = false;  // known by LDAP, not by the file
};
using Users = std::map<std::string, User>;

// "file:line:column: error: ..." if the file is malformed; path and reason if it is unreadable.
class UserFileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// 1 to 32 of a-z A-Z 0-9 . _ -, beginning with a letter.
bool is_user_name(std::string_view name) noexcept;

Users parse_users(std::string_view text, const std::string& file);
Users read_users(const std::filesystem::path& path);
// Whole or not at all: under another name first, 0640, with the owner and group that the file has; a new one of root's
// gets the group of the page's account.
void write_users(const Users& users, const std::filesystem::path& path);

// Who is known to the running page. The file is read again when it changes; what can't be read leaves its users as they
// were, but a file that is gone leaves none. Beside them stand those of a directory who have logged in.
class UserDirectory {
 public:
  // An empty path: there are no users.
  explicit UserDirectory(std::filesystem::path path);

  bool has_file() const noexcept { return !path_.empty(); }
  std::shared_ptr<const Users> users() const;
  // Looks whether the file has changed; by one thread. Returns what is wrong with it, once for each change.
  std::string refresh();

  // Whether the file has the name, in capitals or not: that one wins over a directory's.
  bool is_in_file(const std::string& name) const;
  // Of a directory, `name` in lower case; with the role that he has now.
  void admit(const std::string& name, Role role, const std::string& dn);
  void dismiss(const std::string& name);
  std::vector<std::string> of_directory() const;

 private:
  void put_together();

  std::filesystem::path path_;
  std::string stamp_;  // of the file that was read last
  mutable std::mutex mutex_;
  Users of_file_;
  Users of_directory_;
  std::shared_ptr<const Users> users_;  // both
};

}  // namespace loopwarden::page
