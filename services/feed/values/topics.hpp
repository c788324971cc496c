// SPDX-License-Identifier: Apache-2.0
// Plain topics: the values of a message, and the values that have been silent for too long. Pure:
// the caller passes the time.
//
// Limit: without a time-out for its topic, a dead publisher is not detected.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/protocol/feed_line.hpp"
#include "services/feed/values/topic_payload.hpp"

namespace loopwarden::feed {

struct TopicRule {
  std::string name;   // on feed.sock
  std::string topic;  // without + and #
  PayloadRule payload{};
  bool retained = false;        // a retained message counts also without a time
  std::int64_t timeout_ms = 0;  // silent for longer: bad; 0: never
};

class Topics {
 public:
  struct Counts {
    std::uint64_t bad_payloads = 0;  // values that could not be read
    std::uint64_t unknown = 0;       // messages on a topic of no rule
    std::uint64_t retained = 0;      // values of retained messages, of unknown age: not taken
    std::uint64_t timeouts = 0;
  };

  explicit Topics(const std::vector<TopicRule>& rules);

  // Appends the values of a message; an unreadable value is bad. `complaint` gets its faults.
  void take(const std::string& topic, std::string_view payload, bool retained, std::int64_t now_ms,
            std::vector<protocol::FedValue>& values, std::string& complaint);
  // Appends bad values for topics that have been silent longer than their time-out.
  void look(std::int64_t now_ms, std::vector<protocol::FedValue>& values);
  // The broker is away, so messages may be missed. Appends bad values for all earlier values.
  void disconnected(std::vector<protocol::FedValue>& values);

  const Counts& counts() const noexcept { return counts_; }

 private:
  struct Heard {
    TopicRule rule;
    bool alive = false;  // heard, and neither silent nor lost since
    std::int64_t at_ms = 0;
  };
  static protocol::FedValue bad(const std::string& name, protocol::FedValue::Reason reason);

  std::map<std::string, std::vector<Heard>, std::less<>> topics_;
  Counts counts_;
};

}  // namespace loopwarden::feed
