// SPDX-License-Identifier: Apache-2.0
// Limits how fast passwords can be tried. Users and addresses are counted separately, so neither
// many users from one address nor one user from many addresses gets further. For IPv6 an address is
// its network (/64), because one client has all of it.
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

  // Returns 0 if a try is permitted now (it is counted), otherwise the seconds to wait. The name
  // need not be a user's.
  unsigned wait_s(const std::string& user, const std::string& address, Moment now);
  // The last try was right: it does not count, and the address's earlier tries are forgotten.
  void right(const std::string& user, const std::string& address);
  // The try at `tried` was not checked, so it is neither right nor wrong: it does not count, and
  // causes no wait.
  void not_judged(const std::string& user, const std::string& address, Moment tried);

  // Delay of the answer to a wrong password.
  static constexpr std::chrono::milliseconds kDelay{1000};

 private:
  struct Tries {
    unsigned count = 0;
    Moment last;
    Moment before;  // `last`, before the newest try
  };
  static constexpr std::size_t kMost = 4096;  // entries of each map; then the oldest is dropped

  static Tries& tries_of(std::map<std::string, Tries>& all, const std::string& key, Moment now);

  static void take_back(std::map<std::string, Tries>& all, const std::string& key, Moment tried);

  std::mutex mutex_;
  std::map<std::string, Tries> by_user_;
  std::map<std::string, Tries> by_address_;
};

}  // namespace loopwarden::page
