// SPDX-License-Identifier: Apache-2.0
// One connection to one server of a directory, by libldap, over TLS alone. ldap.conf and LDAP's environment have no say.
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

// The server can't be reached, is not the one it should be, or does not do what it is asked, in words.
class LdapTrouble : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class Depth { entry_itself, all_below };

class Connection {
 public:
  using Moment = std::chrono::steady_clock::time_point;

  // Connects to `server` (HOST:PORT) and begins TLS; each and every later request may take `limit`, none beyond `until`.
  // The look-up of HOST takes what the box's resolver takes. Throws LdapTrouble.
  Connection(const std::string& server, const LdapSettings& settings,
             std::chrono::milliseconds limit, Moment until);
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection();

  std::string tls_version() const;
  // Becomes the one named, with a password that is not empty: a server takes an empty one for an anonymous bind, and
  // says yes. Returns why it did not, in the server's words; empty: done. Throws LdapTrouble.
  std::string bind(const std::string& dn, const std::string& password);
  // Names of the entries that match, two at most; nullopt: there is no `base`. Throws LdapTrouble.
  std::optional<std::vector<std::string>> find(const std::string& base, Depth depth,
                                               const std::string& filter);

 private:
  class Limit;  // below TLS: whatever stands still there ends

  void set_options(const LdapSettings& settings);
  void begin_tls(const LdapSettings& settings);
  // Of the step that begins now. Throws LdapTrouble if no time is left.
  Moment end_of_step() const;
  [[noreturn]] void fail(const std::string& what, int error) const;
  std::string said() const;

  std::string server_;
  std::chrono::milliseconds limit_;
  Moment until_;
  std::unique_ptr<Limit> below_tls_;
  LDAP* handle_ = nullptr;
};

// That `ca_file` can be used. Throws LdapTrouble.
void check_ca_file(const LdapSettings& settings);

}  // namespace loopwarden::page::ldap
