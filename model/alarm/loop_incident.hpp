// SPDX-License-Identifier: Apache-2.0
// An incident: one change of a loop for the operator, with all alarms that the change raises (from
// windows, routine evidence and the twin).
//
//   opens   with the first valve alarm that is raised while no incident is open, at the time of
//           that alarm
//   joins   every valve alarm that is raised while the incident is open
//   ends    kQuiet_ms after the last of these alarms cleared, at the earliest kJoin_ms after it
//           opened
//   name    of the explanation, if that gives one (given_name.hpp). Otherwise of the most specific
//           alarm: low air, which explains the others; the first with a fault's name; unknown. With
//           model_gap as the only alarm: kNotAsCommissioned
//   cause   block of the explanation's effect; without one, the valve if the name is a fault's;
//           otherwise unknown
//
// An incident is acknowledged when none of its alarms waits for the operator. An alarm that joins
// later makes it wait again. Process alarms belong to no incident.
//
// The caller passes the time in ms of a clock that continues after a restart (UTC). If the clock is
// set back, kJoin_ms and kQuiet_ms start again. The incident keeps its opening time, because its id
// is made from it.
//
// No errors.
// Limits: it can't separate two changes of one loop during the first one, or join changes of
// several loops.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "model/alarm/given_name.hpp"
#include "model/alarm/loop_alarms.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::alarm {

inline constexpr const char* kNotAsCommissioned = "no_longer_as_commissioned";

// The data of an incident, which must survive a restart.
struct Incident {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  std::int64_t opened_ms = 0;  // 0: no incident
  std::int64_t since_ms =
      0;                     // opened_ms, or the earlier time to which the clock was set back since
  std::int64_t from_ms = 0;  // start of the change, as far as it is known
  std::int64_t gone_ms = 0;  // when the last condition cleared; 0: a condition is on
  std::int64_t ended_ms = 0;  // 0: it is open
  std::uint16_t alarms = 0;   // one bit per alarm, by index_of
  std::string name;
  std::optional<effects::Block> cause;  // empty: unknown
  double confidence = kNone;  // of the explanation that gave the name; NaN: the name is an alarm's
  struct Renamed {
    std::int64_t at_ms = 0;
    std::string from;
    std::string to;
    friend bool operator==(const Renamed&, const Renamed&) = default;
  };
  std::vector<Renamed> renamed;  // the newest kMostRenamed

  bool there() const noexcept { return opened_ms != 0; }
  bool open() const noexcept { return there() && ended_ms == 0; }
  bool has(AlarmKind kind) const noexcept { return ((alarms >> index_of(kind)) & 1U) != 0; }
  bool explained() const noexcept { return confidence > 0.0; }
  // Returns whether an alarm that was raised at `raised_ms` belongs to this incident. An alarm with
  // a time in the future was raised before the clock was set back, and so was its incident.
  bool covers(std::int64_t raised_ms, std::int64_t now_ms) const noexcept {
    return raised_ms >= since_ms && (raised_ms <= now_ms || opened_ms > now_ms);
  }
};
inline constexpr std::size_t kMostRenamed = 8;

struct IncidentExplanation {
  AlarmKind alarm = AlarmKind::stiction;  // the alarm under which it was raised
  std::int64_t raised_ms = 0;
  std::int64_t from_ms = 0;  // 0: not known
  std::string effect{};      // empty: no effect with a name
  std::optional<effects::Block> block{};
  double confidence = Incident::kNone;
  double gap_closed = Incident::kNone;  // share; NaN: too near to the noise
  bool stick_seen = false;              // by the read-back
};

struct IncidentChange {
  enum class Kind : std::uint8_t { opened, joined, renamed, ended };
  Kind kind = Kind::opened;
  AlarmKind alarm = AlarmKind::stiction;  // opened, joined
  std::string from{};                     // renamed
};
constexpr const char* to_text(IncidentChange::Kind kind) noexcept {
  return numeric::enum_name<IncidentChange::Kind::ended>(kind,
                                                         {"opened", "joined", "renamed", "ended"});
}

class LoopIncident {
 public:
  using Changes = std::vector<IncidentChange>;

  // Follows the alarms: call after each change of an alarm, and as time passes. Without a change:
  // no allocation.
  Changes follow(std::int64_t now_ms, const LoopAlarms& alarms);
  // Adds an explanation of one of its alarms, also after the end. An explanation of another alarm
  // is ignored.
  Changes explained(std::int64_t now_ms, const IncidentExplanation& explanation);
  void restore(Incident incident) { incident_ = std::move(incident); }

  // Returns the open incident, otherwise the newest one.
  const Incident& incident() const noexcept { return incident_; }

 private:
  void name_by_alarms(std::int64_t now_ms, Changes& changes);
  void give_name(std::int64_t now_ms, const std::string& name, std::optional<effects::Block> cause,
                 Changes& changes);

  Incident incident_;
};

// Returns whether an alarm of the incident waits for the operator.
bool unacknowledged(const Incident& incident, const LoopAlarms& alarms) noexcept;

}  // namespace loopwarden::alarm
