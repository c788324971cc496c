// SPDX-License-Identifier: Apache-2.0
#include "services/feed/values/topics.hpp"

#include <utility>

namespace loopwarden::feed {

using protocol::FedValue;

Topics::Topics(const std::vector<TopicRule>& rules) {
  for (const TopicRule& rule : rules) topics_[rule.topic].push_back({.rule = rule});
}

FedValue Topics::bad(const std::string& name, FedValue::Reason reason) {
  return {.name = name, .quality = FedValue::Quality::bad, .reason = reason};
}

void Topics::take(const std::string& topic, std::string_view payload, bool retained,
                  std::int64_t now_ms, std::vector<FedValue>& values, std::string& complaint) {
  const auto found = topics_.find(topic);
  if (found == topics_.end()) {
    ++counts_.unknown;
    return;
  }
  for (Heard& heard : found->second) {
    FedValue fed;
    try {
      fed = read_topic_payload(heard.rule.payload, heard.rule.name, payload);
    } catch (const BadTopicPayload& e) {
      ++counts_.bad_payloads;
      complaint = topic + ", for " + heard.rule.name + ": " + e.what();
      fed = bad(heard.rule.name, FedValue::Reason::source);
    }
    if (retained && !fed.time_s && !heard.rule.retained) {
      ++counts_.retained;
      continue;
    }
    heard.alive = true;
    heard.at_ms = now_ms;
    values.push_back(std::move(fed));
  }
}

void Topics::look(std::int64_t now_ms, std::vector<FedValue>& values) {
  for (auto& [topic, all] : topics_) {
    for (Heard& heard : all) {
      const std::int64_t timeout_ms = heard.rule.timeout_ms;
      if (!heard.alive || timeout_ms == 0 || now_ms - heard.at_ms <= timeout_ms) continue;
      heard.alive = false;
      ++counts_.timeouts;
      values.push_back(bad(heard.rule.name, FedValue::Reason::timeout));
    }
  }
}

void Topics::disconnected(std::vector<FedValue>& values) {
  for (auto& [topic, all] : topics_) {
    for (Heard& heard : all) {
      if (std::exchange(heard.alive, false)) {
        values.push_back(bad(heard.rule.name, FedValue::Reason::link));
      }
    }
  }
}

}  // namespace loopwarden::feed
