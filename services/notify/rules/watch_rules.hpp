// SPDX-License-Identifier: Apache-2.0
// Turns the daemon's readings into events for channels, without a clock and without memory beyond
// the given pictures. The result is first stored, in one transaction, and only then becomes the new
// state. A kill between the two repeats the step instead of losing or doubling it.
//
// Alarms of one incident are reported as one. A channel reports the first that is raised and the
// last that clears or is acknowledged, and one reminder for all.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "services/notify/rules/changes.hpp"
#include "services/notify/rules/routing.hpp"
#include "services/notify/rules/rule_settings.hpp"

namespace loopwarden::notify {

using Pictures = std::map<AlarmKey, AlarmPicture>;

// A line of the daemon's journal, with its author and reason.
struct JournalLine {
  std::int64_t id = 0;
  std::string kind;  // alarm, operator, ...
  AlarmKey key;
  std::string from{};  // the alarm's state before
  std::string to;      // and after
  std::string peer;
  std::string what;  // the operator's action
  std::string reason;
};

struct Post {
  std::string channel;
  Event event;
};

struct Step {
  Pictures changed;
  std::vector<AlarmKey> forgotten;
  std::vector<Post> posts;

  bool empty() const noexcept { return changed.empty() && forgotten.empty() && posts.empty(); }
};

class WatchRules {
 public:
  WatchRules(const RuleSettings& settings, Pictures pictures)
      : settings_(settings), pictures_(std::move(pictures)) {}

  // Processes all alarms of the daemon and the newest lines of its journal, newest first.
  Step read(std::span<const AlarmReading> readings, std::span<const JournalLine> lines,
            std::int64_t now_ms) const;
  // `silent_ms`: time for which the daemon has not answered; 0: it answers.
  Step silence(std::int64_t silent_ms, std::int64_t now_ms) const;
  // Makes the step the new state. Call it when the step is on the disk.
  void accept(const Step& step);

  const Pictures& pictures() const noexcept { return pictures_; }

 private:
  using Readings = std::span<const AlarmReading>;
  // `all`: all readings, of which some may belong to the same incident.
  void look(const AlarmReading& reading, Readings all, std::span<const JournalLine> lines,
            std::int64_t now_ms, Step& step) const;
  // Returns `channels` without those that report, or have reported, another alarm of the incident.
  ChannelNames without_its_others(ChannelNames channels, const Event& event,
                                  const AlarmReading& reading, Readings all,
                                  const Step& step) const;
  const AlarmPicture* picture_of(const AlarmKey& key, const Step& step) const;
  void remind(const AlarmReading& reading, Readings all, AlarmPicture& picture, std::int64_t now_ms,
              Step& step) const;
  void forget_absent(const std::set<AlarmKey>& there, std::int64_t now_ms, Step& step) const;

  const RuleSettings& settings_;
  Pictures pictures_;
};

}  // namespace loopwarden::notify
