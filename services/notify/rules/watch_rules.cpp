// SPDX-License-Identifier: Apache-2.0
#include "services/notify/rules/watch_rules.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace loopwarden::notify {
namespace {

// Returns whether this journal line caused the change.
bool tells_of(const JournalLine& line, const Event& event) {
  if (line.key != AlarmKey{event.loop, event.alarm}) return false;
  if (event.change == Change::acknowledged)
    return line.what == "acknowledge" || line.what == "reset";
  if (event.change == Change::shelved) return line.what == "shelve";
  // Between two readings the alarm may have been raised and cleared: each change has its own line.
  const bool comes = !is_told(line.from) && is_told(line.to);
  const bool goes = is_told(line.from) && !is_told(line.to);
  return line.kind == "alarm" && (event.change == Change::came ? comes : goes);
}

void add_reason(Event& event, std::span<const JournalLine> lines) {
  const auto line = std::find_if(lines.begin(), lines.end(),
                                 [&](const JournalLine& one) { return tells_of(one, event); });
  if (line == lines.end()) return;
  event.peer = line->peer;
  event.reason = line->reason;
}

void post(Step& step, const ChannelNames& channels, const Event& event) {
  for (const std::string& channel : channels) step.posts.push_back({channel, event});
}

}  // namespace

Step WatchRules::read(std::span<const AlarmReading> readings, std::span<const JournalLine> lines,
                      std::int64_t now_ms) const {
  Step step;
  std::set<AlarmKey> there{{"", kDaemonAlarm}};
  for (const AlarmReading& reading : readings) {
    there.insert(reading.key);
    look(reading, readings, lines, now_ms, step);
  }
  forget_absent(there, now_ms, step);
  return step;
}

// Returns the alarm as reported by this step or earlier; null: not reported yet.
const AlarmPicture* WatchRules::picture_of(const AlarmKey& key, const Step& step) const {
  const auto now = step.changed.find(key);
  if (now != step.changed.end()) return &now->second;
  const auto before = pictures_.find(key);
  return before == pictures_.end() ? nullptr : &before->second;
}

ChannelNames WatchRules::without_its_others(ChannelNames channels, const Event& event,
                                            const AlarmReading& reading, Readings all,
                                            const Step& step) const {
  if (reading.incident.empty() || event.change == Change::shelved) return channels;
  const auto since = [&](const AlarmKey& key) {
    const AlarmPicture* picture = picture_of(key, step);
    return std::pair(picture == nullptr ? event.utc_ms : picture->since_ms, key);
  };
  for (const AlarmReading& other : all) {
    const AlarmPicture* picture = picture_of(other.key, step);
    if (other.incident != reading.incident || other.key == reading.key || picture == nullptr) {
      continue;
    }
    Event its = event;
    its.alarm = other.key.second;
    its.worst_percent = picture->worst_percent;
    ChannelNames told;
    switch (event.change) {
      case Change::acknowledged:
        if (picture->unacknowledged) told = channels_of(settings_.routes, its);
        break;
      case Change::unacknowledged:
        // The alarm that has waited longest.
        if (picture->unacknowledged && since(other.key) < since(reading.key)) {
          told = reminded(settings_.routes, its, 0, -1, std::numeric_limits<std::int64_t>::max());
        }
        break;
      default:
        if (is_told(picture->state)) told = channels_of(settings_.routes, its);
    }
    for (const std::string& channel : told) channels.erase(channel);
  }
  return channels;
}

void WatchRules::look(const AlarmReading& reading, Readings all, std::span<const JournalLine> lines,
                      std::int64_t now_ms, Step& step) const {
  const auto known = pictures_.find(reading.key);
  AlarmPicture picture = known == pictures_.end() ? first_picture(reading) : known->second;
  const AlarmPicture before = picture;
  bool came = false;
  for (Event& event : take_changes(picture, reading, now_ms)) {
    came = came || event.change == Change::came;
    add_reason(event, lines);
    post(step, without_its_others(channels_of(settings_.routes, event), event, reading, all, step),
         event);
  }
  if (!came && is_told(picture.state) && picture.worst_percent != before.worst_percent) {
    Event worse = event_of_reading(reading, picture, Change::came, now_ms, now_ms);
    worse.reason = "more severe than when it was raised";
    const ChannelNames channels = newly_told(settings_.routes, worse, before.worst_percent);
    post(step, channels, worse);
    // Channels that report it only now start with the full time to acknowledge.
    if (!channels.empty()) picture.since_ms = picture.reminded_ms = now_ms;
  }
  remind(reading, all, picture, now_ms, step);
  if (known == pictures_.end() || picture != before) step.changed[reading.key] = picture;
}

void WatchRules::remind(const AlarmReading& reading, Readings all, AlarmPicture& picture,
                        std::int64_t now_ms, Step& step) const {
  if (!picture.unacknowledged) return;
  // If a clock was set back, the time counts from now.
  if (picture.reminded_ms > now_ms) picture.since_ms = picture.reminded_ms = now_ms;
  Event event = event_of_reading(reading, picture, Change::unacknowledged, now_ms, now_ms);
  event.waits_min = (now_ms - picture.since_ms) / kMinute;
  const ChannelNames channels = without_its_others(
      reminded(settings_.routes, event, picture.since_ms, picture.reminded_ms, now_ms), event,
      reading, all, step);
  if (channels.empty()) return;
  post(step, channels, event);
  picture.reminded_ms = now_ms;
}

void WatchRules::forget_absent(const std::set<AlarmKey>& there, std::int64_t now_ms,
                               Step& step) const {
  for (const auto& [key, picture] : pictures_) {
    if (there.contains(key)) continue;
    step.forgotten.push_back(key);
    if (!is_told(picture.state)) continue;
    const AlarmReading gone{.key = key, .state = "normal", .severity_percent = std::nullopt};
    Event event = event_of_reading(gone, picture, Change::went, now_ms, now_ms);
    event.reason = "the daemon no longer has this loop";
    post(step, channels_of(settings_.routes, event), event);
  }
}

Step WatchRules::silence(std::int64_t silent_ms, std::int64_t now_ms) const {
  const bool down = silent_ms >= settings_.daemon_down_after_ms;
  const AlarmKey key{"", kDaemonAlarm};
  const auto known = pictures_.find(key);
  AlarmReading reading{.key = key, .state = "normal", .severity_percent = std::nullopt};
  // The state is kept between the first failure and the time after which it counts.
  const bool was_down = known != pictures_.end() && is_told(known->second.state);
  if (down || (was_down && silent_ms > 0)) {
    reading.state = "unacknowledged";
    reading.unacknowledged = true;
  }
  Step step;
  look(reading, {}, {}, now_ms, step);
  return step;
}

void WatchRules::accept(const Step& step) {
  for (const auto& [key, picture] : step.changed) pictures_[key] = picture;
  for (const AlarmKey& key : step.forgotten) pictures_.erase(key);
}

}  // namespace loopwarden::notify
