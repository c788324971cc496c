// SPDX-License-Identifier: Apache-2.0
#include "services/page/users/sessions.hpp"

#include <algorithm>

#include "services/page/users/password.hpp"

namespace loopwarden::page {

bool Sessions::has_ended(const Session& session, Moment now) const noexcept {
  return now - session.begun >= limits_.longest ||
         (!session.display && now - session.used >= limits_.idle);
}

void Sessions::tell(std::size_t ended) const {
  if (ended > 0 && on_end_) on_end_();
}

std::size_t Sessions::make_room(const std::string& user, Moment now) {
  const std::size_t ended =
      std::erase_if(sessions_, [&](const auto& one) { return has_ended(one.second, now); });
  const auto is_of = [&](const auto& one) { return one.second.user == user; };
  const auto of_user =
      static_cast<std::size_t>(std::count_if(sessions_.begin(), sessions_.end(), is_of));
  // A user who logs in again and again loses only his own sessions.
  const bool of_all = of_user < limits_.most_each;
  if (of_all && sessions_.size() < limits_.most) return ended;
  auto oldest = sessions_.end();
  for (auto it = sessions_.begin(); it != sessions_.end(); ++it) {
    if (!of_all && !is_of(*it)) continue;
    if (oldest == sessions_.end() || it->second.seen < oldest->second.seen) oldest = it;
  }
  sessions_.erase(oldest);
  return ended + 1;
}

std::string Sessions::begin(const std::string& user, const User& known, Moment now) {
  const std::string cookie = random_token();
  Session session{.user = user,
                  .password = fingerprint(known.hash),
                  .csrf = random_token(),
                  .display = known.display,
                  .begun = now,
                  .used = now,
                  .seen = now};
  std::size_t ended = 0;
  {
    const std::lock_guard lock(mutex_);
    ended = make_room(user, now);
    sessions_[fingerprint(cookie)] = std::move(session);
  }
  tell(ended);
  return cookie;
}

std::optional<Identity> Sessions::find(const std::string& cookie, const Users& users, Moment now,
                                       bool touch) {
  if (cookie.empty()) return std::nullopt;
  {
    const std::lock_guard lock(mutex_);
    const auto it = sessions_.find(fingerprint(cookie));
    if (it == sessions_.end()) return std::nullopt;
    Session& session = it->second;
    const auto user = users.find(session.user);
    session.display = user != users.end() && user->second.display;
    if (!has_ended(session, now) && user != users.end() &&
        fingerprint(user->second.hash) == session.password) {
      session.seen = now;
      if (touch) session.used = now;
      return Identity{session.user, user->second.role, session.csrf, user->second.directory};
    }
    sessions_.erase(it);
  }
  tell(1);
  return std::nullopt;
}

void Sessions::end(const std::string& cookie) {
  std::size_t ended = 0;
  {
    const std::lock_guard lock(mutex_);
    ended = sessions_.erase(fingerprint(cookie));
  }
  tell(ended);
}

bool Sessions::has(const std::string& user, Moment now) const {
  const std::lock_guard lock(mutex_);
  return std::any_of(sessions_.begin(), sessions_.end(), [&](const auto& one) {
    return one.second.user == user && !has_ended(one.second, now);
  });
}

void Sessions::end_all(const std::string& user) {
  std::size_t ended = 0;
  {
    const std::lock_guard lock(mutex_);
    ended = std::erase_if(sessions_, [&](const auto& one) { return one.second.user == user; });
  }
  tell(ended);
}

std::size_t Sessions::size() const {
  const std::lock_guard lock(mutex_);
  return sessions_.size();
}

}  // namespace loopwarden::page
