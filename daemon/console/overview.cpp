// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/overview.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "daemon/loops/loop_health.hpp"

namespace loopwarden::daemon::console {
namespace {

using alarm::AlarmState;
using protocol::Column;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// States of an alarm, the most urgent last.
constexpr std::array kByUrgency{AlarmState::suppressed,
                                AlarmState::normal,
                                AlarmState::shelved,
                                AlarmState::latched_acknowledged,
                                AlarmState::acknowledged,
                                AlarmState::returned_unacknowledged,
                                AlarmState::latched_unacknowledged,
                                AlarmState::unacknowledged};
static_assert(kByUrgency.size() == alarm::kAlarmStates);

std::size_t urgency(AlarmState state) {
  return static_cast<std::size_t>(std::find(kByUrgency.begin(), kByUrgency.end(), state) -
                                  kByUrgency.begin());
}

// Summary of one loop.
struct Glance {
  bool known = false;  // the loop has run a cycle
  record::RecordRow row;
  double ne107 = kUnknown;
  double alarm = kUnknown;
  double alarm_kind = kUnknown;
  double unacknowledged = 0.0;
  double condition = kUnknown;
  bool not_in_file = false;
  bool commissioned = false;
};

// Finds the most urgent state; among alarms in this state, the one with the highest priority.
void see_alarms(const supervision::AlarmSnapshot& watch, Glance& glance) {
  constexpr std::size_t kPriorities = 4;
  std::size_t worst = 0;
  for (const alarm::AlarmKind kind : alarm::kAlarmKinds) {
    const alarm::Alarm& alarm = watch.alarms.alarm(kind);
    if (alarm.unacknowledged()) glance.unacknowledged += 1.0;
    const std::size_t now = kPriorities * urgency(alarm.state()) +
                            static_cast<std::size_t>(watch.priority[alarm::index_of(kind)]);
    if (now <= worst) continue;
    worst = now;
    const bool quiet =
        alarm.state() == AlarmState::normal || alarm.state() == AlarmState::suppressed;
    glance.alarm_kind = quiet ? kUnknown : static_cast<double>(alarm::index_of(kind));
  }
  const std::size_t state = worst / kPriorities;
  glance.alarm = static_cast<double>(kByUrgency[state]);
}

// Returns the lowest index. If the valve's is not measured, a good one of the others says nothing
// about the valve: it is unknown.
double condition_of(const analysis::ConditionIndices& c) {
  double lowest = kUnknown;
  for (const double index :
       {c.control_performance, c.valve, c.actuator, c.positioner, c.environment}) {
    lowest = std::fmin(lowest, index);  // ignores NaN
  }
  constexpr double kPoor = 50.0;
  return std::isfinite(c.valve) || lowest < kPoor ? lowest : kUnknown;
}

std::vector<Glance> glance_at(const Plant& plant) {
  std::vector<Glance> all(plant.loops.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    Glance& glance = all[i];
    glance.known = plant.historian.latest(i, glance.row);
    glance.not_in_file = plant.loops[i].settings->gains_not_in_file().has_value();
    glance.commissioned = plant.loops[i].commissioning->holder().has_value();
    plant.alarms.look(i, [&](const supervision::AlarmSnapshot& watch) {
      see_alarms(watch, glance);
      glance.condition = condition_of(watch.condition);
      if (!glance.known) return;
      glance.ne107 = static_cast<double>(
          health_of(plant.loops[i].config, glance.row, watch, plant.severe_percent));
    });
  }
  return all;
}

struct Source {
  protocol::Column column;
  double (*value)(const Glance& glance);
  bool of_row = true;  // unknown before the first cycle
};

constexpr std::array kSources{
    Source{Column::period, [](const Glance& g) { return static_cast<double>(g.row.period_index); }},
    Source{Column::pv, [](const Glance& g) { return g.row.pv; }},
    Source{Column::sp, [](const Glance& g) { return g.row.sp; }},
    Source{Column::co, [](const Glance& g) { return g.row.co; }},
    Source{Column::stem, [](const Glance& g) { return g.row.stem; }},
    Source{Column::mode, [](const Glance& g) { return static_cast<double>(g.row.mode); }},
    Source{Column::requested_mode,
           [](const Glance& g) { return static_cast<double>(g.row.requested_mode); }},
    Source{Column::fault, [](const Glance& g) { return static_cast<double>(g.row.fault); }},
    Source{Column::quality, [](const Glance& g) { return static_cast<double>(g.row.pv_quality); }},
    Source{Column::flags, [](const Glance& g) { return static_cast<double>(g.row.flags); }},
    Source{Column::pv_age_ms, [](const Glance& g) { return static_cast<double>(g.row.age_ms); }},
    Source{Column::ne107, [](const Glance& g) { return g.ne107; }},
    Source{Column::alarm, [](const Glance& g) { return g.alarm; }, false},
    Source{Column::alarm_kind, [](const Glance& g) { return g.alarm_kind; }, false},
    Source{Column::alarms_unacknowledged, [](const Glance& g) { return g.unacknowledged; }, false},
    Source{Column::condition, [](const Glance& g) { return g.condition; }, false},
    Source{Column::not_in_file, [](const Glance& g) { return g.not_in_file ? 1.0 : 0.0; }, false},
    Source{Column::commissioned, [](const Glance& g) { return g.commissioned ? 1.0 : 0.0; }, false},
};
static_assert(kSources.size() == protocol::kColumns);

}  // namespace

protocol::Overview overview(const Plant& plant, std::uint32_t config_hash) {
  const std::vector<Glance> all = glance_at(plant);
  protocol::Overview overview{.now_ms = plant.alarms.now_ms(), .config_hash = config_hash};
  for (const Source& source : kSources) {
    std::vector<double>& values = overview[source.column];
    values.reserve(all.size());
    for (const Glance& glance : all) {
      values.push_back(glance.known || !source.of_row ? source.value(glance) : kUnknown);
    }
  }
  return overview;
}

}  // namespace loopwarden::daemon::console
