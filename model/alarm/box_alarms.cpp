// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/box_alarms.hpp"

namespace loopwarden::alarm {

AlarmGuide guide_of(BoxAlarm kind) noexcept {
  switch (kind) {
    case BoxAlarm::disk_full:
      return {
          "records, evidence or something else has filled the disk of the state directory, or it "
          "is broken",
          "nothing more is recorded, and a restart may not remember alarms",
          "make room on the disk, or replace one that does not answer; look at `journal.error` in "
          "the status",
          "an hour"};
    case BoxAlarm::clock_stepped:
      return {"somebody or a time service has set the clock by more than a second",
              "times in records and journal jump; the loops run on, they have a clock of their own",
              "check the box's time service; mind the jump when records are read", "the shift"};
    case BoxAlarm::feeder_lost:
      return {"the program that brings values of watched loops has stopped or can't connect",
              "nothing is known of these loops", "look at the feeder's service and log; start it",
              "an hour"};
    case BoxAlarm::service_failed:
      return {
          "a service beside the daemon (page, edge, notify, feed) has died and does not start "
          "again",
          "what it does is not done: nobody may be told, or see, what happens",
          "`systemctl status` of the service that is named; start it", "an hour"};
    case BoxAlarm::certificate_expires:
      return {"a certificate ends within 14 days",
              "browsers and servers refuse the box from then on",
              "renew the certificate that is named", "a week"};
    case BoxAlarm::records_dropped: break;
  }
  return {"the disk is too slow for what is recorded, or the box too busy",
          "cycles are missing in records or windows; windows begin anew",
          "see what else uses the disk; record fewer loops", "a day"};
}

BoxAlarms::BoxAlarms(const AlarmSettings& settings) noexcept {
  alarms_.fill(Alarm(settings));
  for (Alarm& alarm : alarms_) alarm.always_valid();
}

void BoxAlarms::restore(BoxAlarm kind, const AlarmMemory& memory) noexcept {
  Alarm& alarm = alarms_[index_of(kind)];
  alarm = Alarm(alarm.settings(), memory);
  alarm.always_valid();
  conditions_[index_of(kind)].on = alarm.active();
}

bool BoxAlarms::found(const BoxFindings& findings, std::int64_t monotonic_ms,
                      std::int64_t utc_ms) noexcept {
  bool changed = false;
  for (const BoxAlarm kind : kBoxAlarms) {
    Delayed& condition = conditions_[index_of(kind)];
    Alarm& alarm = alarms_[index_of(kind)];
    changed = alarm.pass_time(utc_ms) || changed;
    const std::optional<bool> now = findings[index_of(kind)];
    if (!now || *now == condition.on) {
      condition.other_since_ms.reset();
      continue;
    }
    if (!condition.other_since_ms) condition.other_since_ms = monotonic_ms;
    const std::int64_t delay_ms = *now ? on_delay_ms(kind) : kBoxOffDelay_ms;
    if (monotonic_ms - *condition.other_since_ms < delay_ms) continue;
    condition = {*now, std::nullopt};
    *now ? alarm.condition_on(utc_ms, 0.0) : alarm.condition_off(utc_ms);
    changed = true;
  }
  return changed;
}

bool BoxAlarms::act(BoxAlarm kind, AlarmAction action, std::int64_t utc_ms,
                    std::int64_t until_ms) noexcept {
  return alarms_[index_of(kind)].act(action, utc_ms, until_ms);
}

unsigned BoxAlarms::active() const noexcept {
  unsigned bits = 0;
  for (const BoxAlarm kind : kBoxAlarms) {
    if (alarm(kind).active()) bits |= 1U << index_of(kind);
  }
  return bits;
}

}  // namespace loopwarden::alarm
