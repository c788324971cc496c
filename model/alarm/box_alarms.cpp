// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/box_alarms.hpp"

namespace loopwarden::alarm {

AlarmGuide guide_of(BoxAlarm kind) noexcept {
  switch (kind) {
    case BoxAlarm::disk_full:
      return {
          "Records, evidence or other files have filled the disk of the state directory, or the "
          "disk is faulty",
          "Recording has stopped, and a restart may lose alarms",
          "Free space on the disk, or replace a disk that does not answer. See `journal.error` in "
          "the status",
          "1 hour"};
    case BoxAlarm::clock_stepped:
      return {"A person or a time service has set the clock by more than 1 s",
              "Times in records and journal jump. The loops continue, because they use a separate "
              "clock",
              "Check the time service of the box. Allow for the jump when you read records",
              "this shift"};
    case BoxAlarm::feeder_lost:
      return {"The program that sends values of watched loops has stopped or can't connect",
              "The state of these loops is unknown",
              "Check the service of the feeder and its log. Start it", "1 hour"};
    case BoxAlarm::service_failed:
      return {
          "A service of the box (page, edge, notify, feed) has failed or its state is not known, a "
          "socket of the daemon can't be opened, or the host does not have the address of the "
          "Modbus server",
          "Alarms may not reach the operator. Masters and programs can't connect",
          "Run `systemctl status` for the named service, and start it. For a socket, correct the "
          "named reason: the daemon tries again every second. For an address, check the network "
          "of the host and `modbus_server.address`",
          "1 hour"};
    case BoxAlarm::certificate_expires:
      return {"A certificate expires within 14 days",
              "After that, browsers and servers refuse the box", "Renew the named certificate",
              "1 week"};
    case BoxAlarm::disk_writes:
      return {
          "The daemon has written more in the last hour than `recording.write_budget_mb` allows",
          "An SD card or eMMC wears out before its time",
          "Raise `recording.sync`, or `sample_time` of the loops. Record fewer loops. Raise the "
          "budget if the disk can take it",
          "1 week"};
    case BoxAlarm::connection_lost:
      return {
          "A link, device, edge node, broker or server does not answer or sends no values",
          "Loopwarden does not receive the values of the named loops. A loop that Loopwarden "
          "controls also can't reach its valve",
          "Check the power and the network of the named part. Watch the loops on the display of "
          "their controller",
          "10 minutes"};
    case BoxAlarm::records_dropped: break;
  }
  return {"The disk is too slow for the records, or the box is too busy",
          "Cycles are missing in records or windows. Windows start again",
          "Check what else uses the disk. Record fewer loops", "1 day"};
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
    const std::int64_t delay_ms = *now ? on_delay_ms(kind) : Limits::kOffDelay_ms;
    if (monotonic_ms - *condition.other_since_ms < delay_ms) continue;
    condition = {*now, std::nullopt};
    *now ? alarm.condition_on(utc_ms, 0.0) : alarm.condition_off(utc_ms);
    changed = true;
  }
  return changed;
}

void BoxAlarms::raise_again(BoxAlarm kind, std::int64_t utc_ms) noexcept {
  Alarm& alarm = alarms_[index_of(kind)];
  if (!alarm.active()) return;
  alarm.condition_off(utc_ms);
  alarm.condition_on(utc_ms, 0.0);
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
