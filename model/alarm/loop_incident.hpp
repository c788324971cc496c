// SPDX-License-Identifier: Apache-2.0
// What is told of a loop: one change of it, however many alarms that raises (by windows, by routine evidence, by the twin).
//
//   opens   with the first valve alarm whose condition comes while none is open, when that was raised
//   joins   every valve alarm whose condition comes while it is open
//   ends    kQuiet_ms after the last of their conditions went, kJoin_ms after it opened at the earliest
//   name    of the explanation, if that gives one (given_name.hpp); otherwise of the alarm that
//   says most: low air, which
//           explains the others; the first with a fault's name; unknown; of model_gap alone, kNotAsCommissioned
//   cause   block of the explanation's effect; of a fault's name without it the valve; else not known
//
// It is acknowledged when none of its alarms waits for the operator: one that joins later makes it wait again.
// Process alarms stand by themselves.
//
// Time is the caller's, ms on a clock that means the same after a restart (UTC). If the clock is
// set back, kJoin_ms and kQuiet_ms start again, and the incident keeps the time at which it opened,
// because its id is made from it.
//
// Errors: none.
// What it can't do: keep two changes of one loop apart while the first lasts; join those of several loops.
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

inline constexpr std::int64_t kJoin_ms = 40LL * 60 * 1000;
inline constexpr std::int64_t kQuiet_ms = 30LL * 60 * 1000;
inline constexpr const char* kNotAsCommissioned = "no_longer_as_commissioned";

// All of an incident, which must survive a restart.
struct Incident {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  std::int64_t opened_ms = 0;  // 0: there is none
  std::int64_t since_ms =
      0;  // opened_ms, or earlier: the time to which the clock was set back since
  std::int64_t from_ms = 0;   // when the loop began to change, as far as it is known
  std::int64_t gone_ms = 0;   // when the last condition went; 0: one is on
  std::int64_t ended_ms = 0;  // 0: it is open
  std::uint16_t alarms = 0;   // a bit each, by index_of
  std::string name;
  std::optional<effects::Block> cause;  // nothing: not known
  double confidence = kNone;  // of the explanation that gave the name; NaN: an alarm gave it
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
  // Whether an alarm that was raised at `raised_ms` is one of this incident. An alarm with a time
  // in the future was raised before the clock was set back, and so was its incident.
  bool covers(std::int64_t raised_ms, std::int64_t now_ms) const noexcept {
    return raised_ms >= since_ms && (raised_ms <= now_ms || opened_ms > now_ms);
  }
};
inline constexpr std::size_t kMostRenamed = 8;

struct IncidentExplanation {
  AlarmKind alarm = AlarmKind::stiction;  // as raised
  std::int64_t raised_ms = 0;
  std::int64_t from_ms = 0;  // 0: not known
  std::string effect{};      // empty: none has a name
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

  // After each change of an alarm, and as time passes. Nothing changed: no allocation.
  Changes follow(std::int64_t now_ms, const LoopAlarms& alarms);
  // Of one of its alarms; of another it changes nothing. It holds after the end, too.
  Changes explained(std::int64_t now_ms, const IncidentExplanation& explanation);
  void restore(Incident incident) { incident_ = std::move(incident); }

  // The open one, else the last there was.
  const Incident& incident() const noexcept { return incident_; }

 private:
  void name_by_alarms(std::int64_t now_ms, Changes& changes);
  void give_name(std::int64_t now_ms, const std::string& name, std::optional<effects::Block> cause,
                 Changes& changes);

  Incident incident_;
};

// Whether one of its alarms waits for the operator.
bool unacknowledged(const Incident& incident, const LoopAlarms& alarms) noexcept;

}  // namespace loopwarden::alarm
