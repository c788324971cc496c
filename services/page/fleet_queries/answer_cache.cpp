// SPDX-License-Identifier: Apache-2.0
#include "services/page/fleet_queries/answer_cache.hpp"

#include <algorithm>

#include "services/page/fleet/fleet.hpp"

namespace loopwarden::fleet {

bool AnswerCache::find(const std::string& key, Answer& answer) const {
  const std::lock_guard lock(mutex_);
  const auto entry = entries_.find(key);
  if (entry != entries_.end() && now_() - entry->second.made < limits_.fresh) {
    answer = entry->second.answer;
    return true;
  }
  if (!why_.empty() && now_() - failed_ < limits_.retry_after) throw FleetDown(why_);
  return false;
}

void AnswerCache::keep(const std::string& key, const Answer& answer) {
  const std::lock_guard lock(mutex_);
  why_.clear();
  entries_[key] = {answer, now_()};
  if (entries_.size() <= limits_.most) return;
  entries_.erase(
      std::min_element(entries_.begin(), entries_.end(),
                       [](const auto& a, const auto& b) { return a.second.made < b.second.made; }));
}

AnswerCache::Answer AnswerCache::get(const std::string& key, const Make& make) {
  Answer answer;
  if (find(key, answer)) return answer;
  const std::lock_guard turn(making_);
  // While this thread waited, another one may have made the answer, or failed.
  if (find(key, answer)) return answer;
  try {
    answer = make();
  } catch (const FleetDown& e) {
    const std::lock_guard lock(mutex_);
    why_ = e.what();
    failed_ = now_();
    throw;
  }
  keep(key, answer);
  return answer;
}

AnswerCache::Answer AnswerCache::last(const std::string& key) const {
  const std::lock_guard lock(mutex_);
  const auto entry = entries_.find(key);
  return entry == entries_.end() ? nullptr : entry->second.answer;
}

}  // namespace loopwarden::fleet
