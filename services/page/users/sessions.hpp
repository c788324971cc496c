// SPDX-License-Identifier: Apache-2.0
// The sessions of logged-in users, only in memory: a restart ends every session.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "services/page/users/role.hpp"
#include "services/page/users/user_file.hpp"

namespace loopwarden::page {

using Moment = std::chrono::steady_clock::time_point;

struct SessionLimits {
  std::chrono::milliseconds longest{12 * 3'600'000};
  // Without input of a person. A display has no such limit.
  std::chrono::milliseconds idle{30 * 60'000};
  std::size_t most = 1000;     // in all
  std::size_t most_each = 20;  // of one user; then his least recently used session ends
};

// The sender of a request. Without a session: user empty, role none.
struct Identity {
  std::string user;
  Role role = Role::none;
  std::string csrf;
  bool directory = false;  // known by LDAP, not by the users file
};

// Any thread.
class Sessions {
 public:
  explicit Sessions(SessionLimits limits) : limits_(limits) {}

  // Returns the cookie's value: 256 random bits, of which only a fingerprint is kept.
  std::string begin(const std::string& user, const User& known, Moment now);
  // Returns nullopt if the session is unknown, too old or too long idle, or its user was removed or
  // has another password. The role is the user's present one. `touch`: a person sent the request;
  // only this keeps the session from being idle.
  std::optional<Identity> find(const std::string& cookie, const Users& users, Moment now,
                               bool touch);
  void end(const std::string& cookie);
  // Returns whether the user has a session.
  bool has(const std::string& user, Moment now) const;
  void end_all(const std::string& user);
  std::size_t size() const;
  // Sets a function that is called after sessions have ended, by the thread that ended them. Call
  // it before the first session begins.
  void on_end(std::function<void()> act) { on_end_ = std::move(act); }

 private:
  struct Session {
    std::string user;
    std::string password;  // fingerprint of the hash that the user had
    std::string csrf;
    bool display = false;
    Moment begun;
    Moment used;  // by a person
    Moment seen;  // by any request
  };
  // Returns how many have ended.
  std::size_t make_room(const std::string& user, Moment now);
  void tell(std::size_t ended) const;
  bool has_ended(const Session& session, Moment now) const noexcept;

  SessionLimits limits_;
  std::function<void()> on_end_;
  mutable std::mutex mutex_;
  std::map<std::string, Session> sessions_;  // by the cookie's fingerprint
};

}  // namespace loopwarden::page
