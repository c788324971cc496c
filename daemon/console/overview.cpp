// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/overview.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "daemon/console/compact_text.hpp"
#include "daemon/loops/loop_health.hpp"

namespace loopwarden::daemon::console {
namespace {

namespace model = loopwarden::monitor;
using model::AlarmState;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// Of an alarm, the most urgent last.
constexpr std::array kByUrgency{AlarmState::suppressed,
                                AlarmState::normal,
                                AlarmState::shelved,
                                AlarmState::latched_acknowledged,
                                AlarmState::acknowledged,
                                AlarmState::returned_unacknowledged,
                                AlarmState::latched_unacknowledged,
                                AlarmState::unacknowledged};
static_assert(kByUrgency.size() == model::kAlarmStates);

std::size_t urgency(AlarmState state) {
  return static_cast<std::size_t>(std::find(kByUrgency.begin(), kByUrgency.end(), state) -
                                  kByUrgency.begin());
}

// One loop at a glance.
struct Glance {
  bool known = false;  // the row is of a cycle
  record::RecordRow row;
  double ne107 = kUnknown;
  double alarm = kUnknown;
  double alarm_kind = kUnknown;
  double unacknowledged = 0.0;
  double condition = kUnknown;
};

// The most urgent state; of two alarms in it, one that is looked after at once.
void see_alarms(const model::LoopAlarms& alarms, Glance& glance) {
  std::size_t worst = 0;
  for (const model::AlarmKind kind : model::kAlarmKinds) {
    const model::Alarm& alarm = alarms.alarm(kind);
    if (alarm.unacknowledged()) glance.unacknowledged += 1.0;
    const std::size_t now = 2 * urgency(alarm.state()) + (model::acts_now(kind) ? 1 : 0);
    if (now <= worst) continue;
    worst = now;
    const bool quiet =
        alarm.state() == AlarmState::normal || alarm.state() == AlarmState::suppressed;
    glance.alarm_kind = quiet ? kUnknown : static_cast<double>(model::index_of(kind));
  }
  const std::size_t state = worst / 2;
  glance.alarm = static_cast<double>(kByUrgency[state]);
}

double lowest_known(const analysis::ConditionIndices& c) {
  double lowest = kUnknown;
  for (const double index :
       {c.control_performance, c.valve, c.actuator, c.positioner, c.environment}) {
    lowest = std::fmin(lowest, index);  // which passes over what is no number
  }
  return lowest;
}

std::vector<Glance> glance_at(const Parts& parts) {
  std::vector<Glance> all(parts.loops.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    Glance& glance = all[i];
    glance.known = parts.historian.latest(i, glance.row);
    parts.board.look(i, [&](const monitor::LoopWatch& watch) {
      see_alarms(watch.alarms, glance);
      glance.condition = lowest_known(watch.condition);
      if (!glance.known) return;
      glance.ne107 = static_cast<double>(
          health_of(parts.loops[i].config, glance.row, watch, parts.severe_percent));
    });
  }
  return all;
}

struct Column {
  const char* name;
  double (*value)(const Glance& glance);
  bool of_row = true;  // not known before the first cycle
};

constexpr std::array kColumns{
    Column{"period", [](const Glance& g) { return static_cast<double>(g.row.period_index); }},
    Column{"pv", [](const Glance& g) { return g.row.pv; }},
    Column{"sp", [](const Glance& g) { return g.row.sp; }},
    Column{"co", [](const Glance& g) { return g.row.co; }},
    Column{"stem", [](const Glance& g) { return g.row.stem; }},
    Column{"mode", [](const Glance& g) { return static_cast<double>(g.row.mode); }},
    Column{"requested_mode",
           [](const Glance& g) { return static_cast<double>(g.row.requested_mode); }},
    Column{"fault", [](const Glance& g) { return static_cast<double>(g.row.fault); }},
    Column{"quality", [](const Glance& g) { return static_cast<double>(g.row.pv_quality); }},
    Column{"flags", [](const Glance& g) { return static_cast<double>(g.row.flags); }},
    Column{"pv_age_ms", [](const Glance& g) { return static_cast<double>(g.row.age_ms); }},
    Column{"ne107", [](const Glance& g) { return g.ne107; }},
    Column{"alarm", [](const Glance& g) { return g.alarm; }, false},
    Column{"alarm_kind", [](const Glance& g) { return g.alarm_kind; }, false},
    Column{"alarms_unacknowledged", [](const Glance& g) { return g.unacknowledged; }, false},
    Column{"condition", [](const Glance& g) { return g.condition; }, false},
};

void put_column(std::string& text, const Column& column, const std::vector<Glance>& all) {
  text += ",\"";
  text += column.name;
  text += "\":[";
  for (const Glance& glance : all) {
    put(text, glance.known || !column.of_row ? column.value(glance) : kUnknown);
    text += ',';
  }
  if (text.back() == ',') text.pop_back();
  text += ']';
}

}  // namespace

std::string overview(const Parts& parts) {
  const std::vector<Glance> all = glance_at(parts);
  std::string text;
  text.reserve(200 + 100 * all.size());
  fmt::format_to(std::back_inserter(text), R"({{"ok":true,"now_ms":{},"config_hash":{})",
                 parts.board.now_ms(), parts.config_hash());
  for (const Column& column : kColumns) put_column(text, column, all);
  text += '}';
  return text;
}

}  // namespace loopwarden::daemon::console
