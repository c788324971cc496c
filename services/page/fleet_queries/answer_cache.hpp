// SPDX-License-Identifier: Apache-2.0
// Answers that many ask for and one makes.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace loopwarden::fleet {

struct CacheLimits {
  std::chrono::milliseconds fresh{5000};        // so long an answer is given again
  std::chrono::milliseconds retry_after{2000};  // after a failure
  std::size_t most = 64;                        // answers kept; the one made longest ago goes
};

// Any thread. Answers are made one at a time, of whatever key.
class AnswerCache {
 public:
  using Answer = std::shared_ptr<const std::string>;
  using Clock = std::chrono::steady_clock;
  // Null: there is nothing of that key; that is kept as any other answer. Throws FleetDown.
  using Make = std::function<Answer()>;

  explicit AnswerCache(CacheLimits limits = {}, std::function<Clock::time_point()> now = Clock::now)
      : limits_(limits), now_(std::move(now)) {}

  // Throws FleetDown, as `make` threw it, if the last attempt failed less than `retry_after` ago and no fresh answer is there.
  Answer get(const std::string& key, const Make& make);
  // However old; null: none.
  Answer last(const std::string& key) const;

 private:
  struct Entry {
    Answer answer;
    Clock::time_point made;
  };
  // The fresh one, in `answer`; throws FleetDown if the last attempt failed less than `retry_after` ago.
  bool find(const std::string& key, Answer& answer) const;
  void keep(const std::string& key, const Answer& answer);

  CacheLimits limits_;
  std::function<Clock::time_point()> now_;
  std::mutex making_;
  mutable std::mutex mutex_;  // of what follows
  std::map<std::string, Entry> entries_;
  std::string why_;  // the newest attempt failed
  Clock::time_point failed_{};
};

}  // namespace loopwarden::fleet
