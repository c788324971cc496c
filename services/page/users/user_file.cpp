// SPDX-License-Identifier: Apache-2.0
#include "services/page/users/user_file.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>

#include "config/diagnostic.hpp"
#include "services/page/users/page_account.hpp"
#include "services/page/users/password.hpp"
#include "base/file.hpp"
#include "base/text.hpp"

namespace loopwarden::page {
namespace {

constexpr std::size_t kMostBytes = 1024UL * 1024UL;
constexpr std::size_t kLongestName = 32;

[[noreturn]] void fail(const std::string& file, std::size_t line, std::size_t column,
                       const std::string& what) {
  throw UserFileError(fmt::format("{}:{}:{}: error: {}", file, line, column, what));
}

[[noreturn]] void fail(const std::filesystem::path& path, int error) {
  throw UserFileError(path.string() + ": " + base::error_text(error));
}

void parse_line(std::string_view text, const std::string& file, std::size_t line, Users& users) {
  const std::size_t first = text.find(':');
  const std::size_t second = first == std::string_view::npos ? first : text.find(':', first + 1);
  if (second == std::string_view::npos) fail(file, line, 1, "expected name:role:hash");
  const std::string name(text.substr(0, first));
  if (!is_user_name(name)) fail(file, line, 1, "that is no user name");
  if (users.contains(name)) fail(file, line, 1, "user '" + name + "' occurs twice");
  const std::string_view role_text = text.substr(first + 1, second - first - 1);
  const std::optional<Role> role = role_of(role_text);
  if (!role) {
    const std::array<std::string, 3> known{"viewer", "operator", "engineer"};
    fail(file, line, first + 2,
         fmt::format("expected viewer, operator or engineer (got '{}'){}",
                     config::quotable(role_text), config::suggestion(role_text, known)));
  }
  const std::size_t third = text.find(':', second + 1);
  const std::string_view hash = text.substr(second + 1, third - second - 1);
  if (!is_hash(hash)) fail(file, line, second + 2, "that is no hash by argon2id");
  const bool display = third != std::string_view::npos;
  if (display && text.substr(third + 1) != "display") {
    fail(file, line, third + 2, "expected display or the end of the line after the hash");
  }
  if (display && *role != Role::viewer) {
    fail(file, line, third + 2, "a display is a viewer");
  }
  users[name] = {*role, std::string(hash), display};
}

std::string stamp_of(const std::filesystem::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return "none";
  return fmt::format("{} {} {}.{:09}", status.st_ino, status.st_size, status.st_mtim.tv_sec,
                     status.st_mtim.tv_nsec);
}

std::string to_text(const Users& users) {
  std::string text = "# Users of loopwarden-page; written by `loopwarden-page user`.\n";
  for (const auto& [name, user] : users) {
    text += fmt::format("{}:{}:{}{}\n", name, page::to_text(user.role), user.hash,
                        user.display ? ":display" : "");
  }
  return text;
}

// Keeps owner and group of the existing file. A new file of root's gets the page's group.
void keep_owner(int fd, const std::filesystem::path& path) {
  struct stat status {};
  uid_t user = ::geteuid();
  gid_t group = ::getegid();
  if (::stat(path.c_str(), &status) == 0) {
    user = status.st_uid;
    group = status.st_gid;
  } else if (const auto account = page_account()) {
    group = account->group;
  }
  if (::fchown(fd, user, group) != 0 && ::geteuid() == 0) fail(path, errno);
}

bool has_name(const Users& users, const std::string& name) {
  return std::any_of(users.begin(), users.end(), [&](const auto& one) {
    return base::lower_case(one.first) == base::lower_case(name);
  });
}

}  // namespace

bool is_user_name(std::string_view name) noexcept {
  const auto is_part = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '_' || c == '-';
  };
  return !name.empty() && name.size() <= kLongestName &&
         std::isalpha(static_cast<unsigned char>(name.front())) != 0 &&
         std::all_of(name.begin(), name.end(), is_part);
}

Users parse_users(std::string_view text, const std::string& file) {
  Users users;
  for (std::size_t line = 1; !text.empty(); ++line) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view one = text.substr(0, end);
    if (!one.empty() && one.front() != '#') parse_line(one, file, line, users);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return users;
}

Users read_users(const std::filesystem::path& path) {
  const std::optional<std::string> text = base::read_file(path, kMostBytes);
  if (!text && errno == EFBIG) throw UserFileError(path.string() + ": is larger than 1 MiB");
  if (!text) fail(path, errno);
  return parse_users(*text, path.string());
}

void write_users(const Users& users, const std::filesystem::path& path) {
  const auto prepare = [&](int fd) {
    if (::fchmod(fd, 0640) != 0) fail(path, errno);
    keep_owner(fd, path);
  };
  const std::optional<base::FileError> error =
      base::replace_file(path, to_text(users), {.prepare = prepare});
  if (error) fail(error->file, error->error);
}

UserDirectory::UserDirectory(std::filesystem::path path)
    : path_(std::move(path)), users_(std::make_shared<const Users>()) {}

std::shared_ptr<const Users> UserDirectory::users() const {
  const std::lock_guard lock(mutex_);
  return users_;
}

std::string UserDirectory::refresh() {
  if (path_.empty()) return {};
  const std::string stamp = stamp_of(path_);
  if (stamp == stamp_) return {};
  stamp_ = stamp;
  try {
    Users users = stamp == "none" ? Users() : read_users(path_);
    const std::lock_guard lock(mutex_);
    of_file_ = std::move(users);
    put_together();
  } catch (const UserFileError& e) {
    return e.what();
  }
  return stamp == "none" ? path_.string() + ": there is no such file, so no user of it can log in"
                         : "";
}

bool UserDirectory::is_in_file(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  return has_name(of_file_, name);
}

void UserDirectory::admit(const std::string& name, Role role, const std::string& dn) {
  const std::lock_guard lock(mutex_);
  of_directory_[name] = {role, dn, false, true};
  put_together();
}

void UserDirectory::dismiss(const std::string& name) {
  const std::lock_guard lock(mutex_);
  of_directory_.erase(name);
  put_together();
}

std::vector<std::string> UserDirectory::of_directory() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> names;
  for (const auto& [name, user] : of_directory_) names.push_back(name);
  return names;
}

// A name that was added to the file belongs to the file's user from then on.
void UserDirectory::put_together() {
  std::erase_if(of_directory_, [&](const auto& one) { return has_name(of_file_, one.first); });
  Users both = of_file_;
  both.insert(of_directory_.begin(), of_directory_.end());
  users_ = std::make_shared<const Users>(std::move(both));
}

}  // namespace loopwarden::page
