// SPDX-License-Identifier: Apache-2.0
// Checks users by the directory of page.yaml, and derives their role from its groups.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "services/page/settings/ldap_settings.hpp"

namespace loopwarden::page::ldap {

class Connection;

struct Outcome {
  enum class End {
    admitted,
    wrong,       // no such user, or another password
    no_group,    // the right password, but no group with a role
    unavailable  // the directory gave no answer
  };
  End end = End::unavailable;
  Role role = Role::none;
  std::string dn;
  std::string why;  // if he is not admitted; without the typed text
};

class Server {
 public:
  // Called with each finished step, for a person at a terminal.
  using Tell = std::function<void(const std::string&)>;

  using Moment = std::chrono::steady_clock::time_point;

  explicit Server(LdapSettings settings, std::chrono::milliseconds limit = std::chrono::seconds(3));

  // `name`: from account_name(). Each call uses a new connection, whose steps may take `limit` and
  // must end before `until`. Throw only std::bad_alloc.
  Outcome log_in(const std::string& name, const std::string& password, const Tell& tell,
                 Moment until = Moment::max()) const;
  // Returns the user's present role without his password. It is `wrong` only if he no longer
  // exists.
  Outcome look_up(const std::string& name, Moment until = Moment::max()) const;

 private:
  Outcome ask(const std::string& name, const std::string* password, const Tell& tell,
              Moment until) const;
  std::unique_ptr<Connection> connect(const Tell& tell, Moment until) const;
  std::string dn_of(Connection& connection, const std::string& name, std::string& why) const;
  Role role_of(Connection& connection, const std::string& name, const std::string& dn,
               const Tell& tell) const;

  LdapSettings settings_;
  std::chrono::milliseconds limit_;
};

// Checks that the CA file can be used, and that only the page's user can read the password of
// bind_dn. Throws std::runtime_error.
void check_files(const LdapSettings& settings);

}  // namespace loopwarden::page::ldap
