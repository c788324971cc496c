// SPDX-License-Identifier: Apache-2.0
#include "services/page/boxes/box.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "base/clock.hpp"
#include "daemon/protocol/ask.hpp"

namespace loopwarden::page {
namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::json;

// Sizes and times of alarms change without a change of state: alarms are read at least this often.
constexpr std::chrono::seconds kAlarmsAtLeast{5};

std::vector<double> alarm_columns(const protocol::Overview& overview) {
  using protocol::Column;
  std::vector<double> all;
  for (const Column column : {Column::alarm, Column::alarm_kind, Column::alarms_unacknowledged}) {
    all.insert(all.end(), overview[column].begin(), overview[column].end());
  }
  return all;
}

bool is_there(const protocol::Alarm& alarm) { return alarm.active || alarm.unacknowledged; }

// Returns whether the daemon has restarted between two readings: its periods count from its start.
bool has_begun_anew(const std::shared_ptr<const std::vector<double>>& before,
                    const std::vector<double>& now) {
  if (!before || before->size() != now.size()) return true;
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (now[i] < (*before)[i]) return true;
  }
  return false;
}

// Returns how long the plant has run, by the loop with the longest time.
std::int64_t plant_ms(const std::vector<protocol::LoopDescription>& loops,
                      const std::vector<double>& periods) {
  double longest_s = 0.0;
  for (std::size_t i = 0; i < std::min(periods.size(), loops.size()); ++i) {
    longest_s = std::fmax(longest_s, periods[i] * loops[i].sample_time_s);
  }
  return static_cast<std::int64_t>(1000.0 * longest_s);
}

}  // namespace

json alarms_for_page(const protocol::Alarms& all) {
  json shown = json::array();
  std::map<std::string, std::pair<std::int64_t, std::size_t>> first;  // by loop: when, which
  for (const protocol::Alarm& alarm : all.alarms) {
    // A suppressed alarm that is off was not raised. In a plant at rest these would be all alarms.
    if (alarm.state == "normal" || (alarm.state == "suppressed" && !is_there(alarm))) continue;
    json one = alarm;
    one["first_out"] = false;
    if (is_there(alarm)) {
      const auto [it, is_new] = first.try_emplace(alarm.loop, alarm.raised_ms, shown.size());
      if (!is_new && alarm.raised_ms < it->second.first) {
        it->second = {alarm.raised_ms, shown.size()};
      }
    }
    shown.push_back(std::move(one));
  }
  for (const auto& [loop, one] : first) shown[one.second]["first_out"] = true;
  json incidents = json::array();
  for (const protocol::Incident& incident : all.incidents) {
    if (incident.active || incident.unacknowledged) incidents.push_back(incident);
  }
  return {{"alarms", std::move(shown)}, {"incidents", std::move(incidents)}};
}

Box::Box(BoxSettings settings)
    : settings_(std::move(settings)), daemon_(settings_.status_socket, settings_.patience) {
  now_.since_ms = base::utc_ms();
  now_.why = "not asked yet";
}

void Box::start(Publish publish, Task task) {
  publish_ = std::move(publish);
  task_ = std::move(task);
  constexpr std::size_t kStackBytes = 1024UL * 1024UL;
  thread_.start({.name = "pg-box", .stack_bytes = kStackBytes}, [this] { run(); });
}

void Box::stop() {
  base::ask_to_end(mutex_, quit_, changed_);
  thread_.join();
}

void Box::listeners(std::size_t count) {
  {
    const std::lock_guard lock(mutex_);
    hurry_ = hurry_ || count > listeners_;
    listeners_ = count;
  }
  changed_.notify_all();
}

Box::Now Box::now() const {
  const std::lock_guard lock(mutex_);
  return now_;
}

std::string Box::sparklines() const {
  const std::lock_guard lock(mutex_);
  return sparklines_.json(now_.now_ms);
}

void Box::run() {
  for (;;) {
    try {
      if (!settings_.status_socket.empty()) look();
      task_();
    } catch (const std::exception& e) {
      spdlog::error("box: {}", e.what());
    }
    wait();
    const std::lock_guard lock(mutex_);
    if (quit_) return;
  }
}

void Box::wait() {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, listeners_ > 0 ? settings_.live : settings_.quiet,
                    [this] { return quit_ || hurry_; });
  hurry_ = false;
}

void Box::look() {
  try {
    look_at(daemon_.ask_text(json(protocol::OverviewRequest{}).dump()));
  } catch (const protocol::DaemonError& e) {
    went_down(e.what());
  }
}

void Box::look_at(const std::string& text) {
  const auto overview = protocol::read_answer<protocol::Overview>(protocol::answer_in(text));
  const Now before = now();
  auto periods = std::make_shared<const std::vector<double>>(overview[protocol::Column::period]);
  if (!before.up || !before.state || before.state->about.config_hash != overview.config_hash ||
      has_begun_anew(before.periods, *periods)) {
    fetch_state();
  }
  {
    const std::lock_guard lock(mutex_);
    now_.now_ms = overview.now_ms;
    now_.periods = std::move(periods);
    sparklines_.add(plant_ms(now_.state->about.loops, *now_.periods),
                    overview[protocol::Column::pv]);
  }
  std::vector<double> columns = alarm_columns(overview);
  if (!protocol::same(columns, alarm_columns_) || Clock::now() >= alarms_due_) {
    fetch_alarms();
    alarm_columns_ = std::move(columns);
    alarms_due_ = Clock::now() + kAlarmsAtLeast;
  }
  if (!before.up) came_up();
  publish_(http::EventKind::overview, text);
}

void Box::fetch_state() {
  auto state = box_state_of(daemon_.ask(protocol::DescribeRequest{}));
  {
    const std::lock_guard lock(mutex_);
    now_.state = std::move(state);
  }
  publish_(http::EventKind::describe, "{}");
}

void Box::fetch_alarms() {
  const protocol::Alarms all = ask(daemon_, protocol::AlarmsRequest{});
  json alarms = alarms_for_page(all);
  std::string list = alarms.dump();
  alarms["now_ms"] = all.now_ms;
  {
    const std::lock_guard lock(mutex_);
    now_.alarms = std::make_shared<const std::string>(alarms.dump());
  }
  if (list == alarm_list_) return;
  publish_(http::EventKind::alarms, list);
  alarm_list_ = std::move(list);
}

void Box::publish_state(const Now& now) const {
  publish_(http::EventKind::daemon,
           json{{"up", now.up}, {"since_ms", now.since_ms}, {"why", now.why}}.dump(
               -1, ' ', false, json::error_handler_t::replace));
}

void Box::came_up() {
  {
    const std::lock_guard lock(mutex_);
    now_.up = true;
    now_.since_ms = base::utc_ms();
    now_.why.clear();
  }
  spdlog::info("the daemon answers");
  publish_state(now());
}

void Box::went_down(const std::string& why) {
  const Now before = now();
  if (!before.up && before.why == why) return;
  {
    const std::lock_guard lock(mutex_);
    if (now_.up) now_.since_ms = base::utc_ms();
    now_.up = false;
    now_.why = why;
  }
  spdlog::warn("the daemon does not answer: {}", why);
  publish_state(now());
}

}  // namespace loopwarden::page
