// SPDX-License-Identifier: Apache-2.0
#include "page/users/sessions.hpp"

#include <algorithm>

#include "page/users/password.hpp"

namespace loopwarden::page {

bool Sessions::has_ended(const Session& session, Moment now) const noexcept {
  return now - session.begun >= limits_.longest || now - session.used >= limits_.idle;
}

void Sessions::make_room(const std::string& user, Moment now) {
  std::erase_if(sessions_, [&](const auto& one) { return has_ended(one.second, now); });
  const auto is_of = [&](const auto& one) { return one.second.user == user; };
  const auto of_user =
      static_cast<std::size_t>(std::count_if(sessions_.begin(), sessions_.end(), is_of));
  // Who logs in again and again pushes out himself.
  const bool of_all = of_user < limits_.most_each;
  if (of_all && sessions_.size() < limits_.most) return;
  auto oldest = sessions_.end();
  for (auto it = sessions_.begin(); it != sessions_.end(); ++it) {
    if (!of_all && !is_of(*it)) continue;
    if (oldest == sessions_.end() || it->second.used < oldest->second.used) oldest = it;
  }
  sessions_.erase(oldest);
}

std::string Sessions::begin(const std::string& user, const User& known, Moment now) {
  const std::string cookie = random_token();
  const std::lock_guard lock(mutex_);
  make_room(user, now);
  sessions_[fingerprint(cookie)] = {.user = user,
                                    .password = fingerprint(known.hash),
                                    .csrf = random_token(),
                                    .begun = now,
                                    .used = now};
  return cookie;
}

std::optional<Identity> Sessions::find(const std::string& cookie, const Users& users, Moment now,
                                       bool touch) {
  if (cookie.empty()) return std::nullopt;
  const std::lock_guard lock(mutex_);
  const auto it = sessions_.find(fingerprint(cookie));
  if (it == sessions_.end()) return std::nullopt;
  const auto user = users.find(it->second.user);
  if (has_ended(it->second, now) || user == users.end() ||
      fingerprint(user->second.hash) != it->second.password) {
    sessions_.erase(it);
    return std::nullopt;
  }
  if (touch) it->second.used = now;
  return Identity{it->second.user, user->second.role, it->second.csrf};
}

void Sessions::end(const std::string& cookie) {
  const std::lock_guard lock(mutex_);
  sessions_.erase(fingerprint(cookie));
}

std::size_t Sessions::size() const {
  const std::lock_guard lock(mutex_);
  return sessions_.size();
}

}  // namespace loopwarden::page
