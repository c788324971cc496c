// SPDX-License-Identifier: Apache-2.0
// Reads and writes the users file: one line per user, name:role:hash, then :display for a wall
// display. Empty lines and lines that begin with # are ignored.
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
  std::string hash;        // argon2id; for a directory's user, his name there
  bool display = false;    // an unattended wall display: no idle limit; a viewer
  bool directory = false;  // known by LDAP, not by the file
};
using Users = std::map<std::string, User>;

// Its text is "file:line:column: error: ..." if malformed, path and reason if unreadable.
class UserFileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Returns whether the name has 1 to 32 of a-z A-Z 0-9 . _ -, beginning with a letter.
bool is_user_name(std::string_view name) noexcept;

Users parse_users(std::string_view text, const std::string& file);
Users read_users(const std::filesystem::path& path);
// Writes the file as a whole or not at all: first under another name, 0640, with the owner and
// group of the existing file. A new file of root's gets the group of the page's account.
void write_users(const Users& users, const std::filesystem::path& path);

// The users of the running page: those of the file, and those of a directory who have logged in.
// The file is read again when it changes. If it can't be read, its users stay; if it is gone, it
// has no users.
class UserDirectory {
 public:
  // An empty path means that there are no users.
  explicit UserDirectory(std::filesystem::path path);

  bool has_file() const noexcept { return !path_.empty(); }
  std::shared_ptr<const Users> users() const;
  // Checks whether the file has changed; to be called by one thread. Returns the file's fault, once
  // for each change.
  std::string refresh();

  // Returns whether the file has the name, ignoring case. The file's user replaces a directory's.
  bool is_in_file(const std::string& name) const;
  // Adds a user of the directory, `name` in lower case, with his present role.
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
