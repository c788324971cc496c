// SPDX-License-Identifier: Apache-2.0
// Caches answers that many clients request, so that each is made once.
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
  std::chrono::milliseconds fresh{5000};        // an answer is reused for this time
  std::chrono::milliseconds retry_after{2000};  // after a failure
  std::size_t most = 64;                        // most answers kept; the oldest is dropped
};

// Thread-safe. Answers are made one at a time, whatever their key.
class AnswerCache {
 public:
  using Answer = std::shared_ptr<const std::string>;
  using Clock = std::chrono::steady_clock;
  // Makes an answer. Null means that the key has no data; it is cached like any answer. Throws
  // FleetDown.
  using Make = std::function<Answer()>;

  explicit AnswerCache(CacheLimits limits = {}, std::function<Clock::time_point()> now = Clock::now)
      : limits_(limits), now_(std::move(now)) {}

  // Returns a fresh answer, making it if needed. Throws FleetDown, as `make` did, if no fresh
  // answer exists and the last attempt failed less than `retry_after` ago.
  Answer get(const std::string& key, const Make& make);
  // Returns the newest answer of any age; null: no answer.
  Answer last(const std::string& key) const;

 private:
  struct Entry {
    Answer answer;
    Clock::time_point made;
  };
  // Finds the fresh answer. Throws FleetDown if the last attempt failed less than `retry_after`
  // ago.
  bool find(const std::string& key, Answer& answer) const;
  void keep(const std::string& key, const Answer& answer);

  CacheLimits limits_;
  std::function<Clock::time_point()> now_;
  std::mutex making_;
  mutable std::mutex mutex_;  // guards the members below
  std::map<std::string, Entry> entries_;
  std::string why_;  // reason, if the newest attempt failed
  Clock::time_point failed_{};
};

}  // namespace loopwarden::fleet
