// SPDX-License-Identifier: Apache-2.0
// How fast passwords can be tried. A user and an address are counted each: neither many users from one address
// nor one user from many addresses gets further. Of IPv6 an address is its network (/64), all of which one client has.
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <mutex>
#include <string>

namespace loopwarden::page {

class LogInGuard {
 public:
  using Moment = std::chrono::steady_clock::time_point;

  // 0: it may be tried now, and counts as tried; else the seconds to wait. The name need not be a user's.
  unsigned wait_s(const std::string& user, const std::string& address, Moment now);
  // The one just tried was right: it does not count, and the address's earlier ones are forgotten.
  void right(const std::string& user, const std::string& address);
  // The one tried at `tried` was neither right nor wrong, since nobody judged it: it does not count, nor wait.
  void not_judged(const std::string& user, const std::string& address, Moment tried);

  // A wrong password is answered after this.
  static constexpr std::chrono::milliseconds kDelay{1000};

 private:
  struct Tries {
    unsigned count = 0;
    Moment last;
    Moment before;  // `last`, before the newest try
  };
  static constexpr std::size_t kMost = 4096;  // of each map; then the oldest goes

  static Tries& tries_of(std::map<std::string, Tries>& all, const std::string& key, Moment now);

  static void take_back(std::map<std::string, Tries>& all, const std::string& key, Moment tried);

  std::mutex mutex_;
  std::map<std::string, Tries> by_user_;
  std::map<std::string, Tries> by_address_;
};

}  // namespace loopwarden::page
