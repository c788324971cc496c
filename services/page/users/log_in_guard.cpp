// SPDX-License-Identifier: Apache-2.0
#include "services/page/users/log_in_guard.hpp"

#include <algorithm>
#include <utility>

namespace loopwarden::page {
namespace {

using std::chrono::seconds;

constexpr seconds kForgotten{900};  // without a try
// The first tries cost only the delay, then the wait doubles. A user's longest wait is short, so a
// user whom a stranger locks out gets in again soon. 120 passwords per hour are too few to find a
// good one.
constexpr unsigned kFreeOfUser = 5;
constexpr unsigned kFreeOfAddress = 10;
constexpr seconds kLongestOfUser{30};
constexpr seconds kLongestOfAddress{300};

seconds wait_after(unsigned count, unsigned free, seconds longest) {
  if (count < free) return seconds(0);
  const unsigned doublings = std::min(count - free, 10U);
  return std::min(longest, seconds(1L << doublings));
}

}  // namespace

LogInGuard::Tries& LogInGuard::tries_of(std::map<std::string, Tries>& all, const std::string& key,
                                        Moment now) {
  std::erase_if(all, [&](const auto& one) { return now - one.second.last > kForgotten; });
  if (all.size() >= kMost && !all.contains(key)) {
    all.erase(std::min_element(all.begin(), all.end(), [](const auto& a, const auto& b) {
      return a.second.last < b.second.last;
    }));
  }
  return all.try_emplace(key, Tries{0, now, now}).first->second;
}

unsigned LogInGuard::wait_s(const std::string& user, const std::string& address, Moment now) {
  const std::lock_guard lock(mutex_);
  Tries& of_user = tries_of(by_user_, user, now);
  Tries& of_address = tries_of(by_address_, address, now);
  const Moment free_at =
      std::max(of_user.last + wait_after(of_user.count, kFreeOfUser, kLongestOfUser),
               of_address.last + wait_after(of_address.count, kFreeOfAddress, kLongestOfAddress));
  if (free_at > now) {
    return static_cast<unsigned>(std::chrono::ceil<seconds>(free_at - now).count());
  }
  for (Tries* tries : {&of_user, &of_address}) {
    ++tries->count;
    tries->before = std::exchange(tries->last, now);
  }
  return 0;
}

void LogInGuard::right(const std::string& user, const std::string& address) {
  const std::lock_guard lock(mutex_);
  by_user_.erase(user);
  by_address_.erase(address);
}

void LogInGuard::take_back(std::map<std::string, Tries>& all, const std::string& key,
                           Moment tried) {
  const auto found = all.find(key);
  if (found == all.end() || found->second.count == 0) return;
  --found->second.count;
  if (found->second.last == tried) found->second.last = found->second.before;
}

void LogInGuard::not_judged(const std::string& user, const std::string& address, Moment tried) {
  const std::lock_guard lock(mutex_);
  take_back(by_user_, user, tried);
  take_back(by_address_, address, tried);
}

}  // namespace loopwarden::page
