// SPDX-License-Identifier: Apache-2.0
// Who somebody is by the directory of page.yaml, and what role its groups give him.
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
    no_group,    // the right password, but no group that gives a role
    unavailable  // the directory did not say
  };
  End end = End::unavailable;
  Role role = Role::none;
  std::string dn;
  std::string why;  // where he is not admitted; without what was typed
};

class Server {
 public:
  // Each step is told as it is done, for a person at a terminal.
  using Tell = std::function<void(const std::string&)>;

  using Moment = std::chrono::steady_clock::time_point;

  explicit Server(LdapSettings settings, std::chrono::milliseconds limit = std::chrono::seconds(3));

  // `name`: of account_name(). A connection of its own each, whose steps may take `limit`, none beyond `until`. Throw
  // nothing but std::bad_alloc.
  Outcome log_in(const std::string& name, const std::string& password, const Tell& tell,
                 Moment until = Moment::max()) const;
  // As he is now, without his password: never `wrong` but where he is no longer there.
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

// That the CA file can be used, and that the password of bind_dn can be read, by the page's user and nobody else. Throws
// std::runtime_error.
void check_files(const LdapSettings& settings);

}  // namespace loopwarden::page::ldap
