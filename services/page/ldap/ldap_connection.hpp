// SPDX-License-Identifier: Apache-2.0
// One connection to one server of a directory, by libldap, always over TLS. ldap.conf and LDAP's
// environment variables are ignored.
#pragma once

#include <ldap.h>

#include <chrono>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "services/page/settings/ldap_settings.hpp"

namespace loopwarden::page::ldap {

// The server is unreachable, not the expected one, or refuses a request. what() has the reason.
class LdapTrouble : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class Depth { entry_itself, all_below };

class Connection {
 public:
  using Moment = std::chrono::steady_clock::time_point;

  // Connects to `server` (HOST:PORT) and starts TLS. This and each later request may take `limit`,
  // and must end before `until`. The box's resolver may need more time for HOST. Throws
  // LdapTrouble.
  Connection(const std::string& server, const LdapSettings& settings,
             std::chrono::milliseconds limit, Moment until);
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection();

  std::string tls_version() const;
  // Binds as `dn`. `password` must not be empty: servers take an empty one for an anonymous bind
  // and accept it. Returns the server's reason for a refusal; empty: bound. Throws LdapTrouble.
  std::string bind(const std::string& dn, const std::string& password);
  // Returns at most two names of matching entries; nullopt if `base` is missing. Throws
  // LdapTrouble.
  std::optional<std::vector<std::string>> find(const std::string& base, Depth depth,
                                               const std::string& filter);

 private:
  class Limit;  // below TLS: ends a connection that hangs there

  void set_options(const LdapSettings& settings);
  void begin_tls(const LdapSettings& settings);
  // Returns the end of the step that begins now. Throws LdapTrouble if no time is left.
  Moment end_of_step() const;
  [[noreturn]] void fail(const std::string& what, int error) const;
  std::string said() const;

  std::string server_;
  std::chrono::milliseconds limit_;
  Moment until_;
  std::unique_ptr<Limit> below_tls_;
  LDAP* handle_ = nullptr;
};

// Checks that `ca_file` can be used. Throws LdapTrouble.
void check_ca_file(const LdapSettings& settings);

}  // namespace loopwarden::page::ldap
