// SPDX-License-Identifier: Apache-2.0
#include "services/page/fleet_queries/fleet_database.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include "services/database/connection.hpp"

namespace loopwarden::fleet {
namespace {

using nlohmann::json;
using std::chrono::minutes;

constexpr Purpose kForPage{
    .program = "loopwarden-page", .statement_seconds = 20, .read_only = true};
constexpr minutes kCurvesFresh{5};
constexpr minutes kVersionsFresh{1};
constexpr std::size_t kMostGroupsKept = 100;
constexpr std::size_t kMostCurvesKept = 20'000;
constexpr std::size_t kMostGroupsShown = 100;

AnswerCache::Answer answer_of(const json& what) {
  return std::make_shared<const std::string>(
      what.dump(-1, ' ', false, json::error_handler_t::replace));
}

json span_json(const RateOfSpan& span) {
  return {{"raised", span.raised},
          {"per_10_min", span.per_bin},
          {"most", span.most},
          {"flood_percent", span.flood_percent}};
}

json rate_json(const std::string& group, const AlarmRate& rate) {
  return {{"group", group},
          {"day", span_json(rate.day)},
          {"week", span_json(rate.week)},
          {"bins", rate.bins}};
}

// Returns the rates of the groups with the most alarms. The rate of all groups together is first.
json rates_json(const std::map<std::string, AlarmRate>& rates, std::int64_t until_s) {
  std::vector<std::pair<std::string, AlarmRate>> order(rates.begin(), rates.end());
  std::stable_sort(order.begin() + 1, order.end(), [](const auto& a, const auto& b) {
    return a.second.week.raised > b.second.week.raised;
  });
  if (order.size() > kMostGroupsShown) order.resize(kMostGroupsShown);
  json list = json::array();
  for (const auto& [group, rate] : order) list.push_back(rate_json(group, rate));
  return {{"until_ms", 1000 * until_s},
          {"bin_s", kBin_s},
          {"figures",
           {{"acceptable", kAcceptable},
            {"most", kMostManageable},
            {"flood", kFlood},
            {"flood_percent", kMostFlood_percent}}},
          {"list", std::move(list)}};
}

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

}  // namespace

FleetDatabase::FleetDatabase(DatabaseSettings settings, CacheLimits limits)
    : settings_(std::move(settings)), overviews_(limits), valves_(limits) {}

std::shared_ptr<const std::string> FleetDatabase::overview(const std::string& group) {
  return overviews_.get(group, [&] { return make_overview(group); });
}

std::shared_ptr<const std::string> FleetDatabase::last_overview(const std::string& group) {
  return overviews_.last(group);
}

std::shared_ptr<const std::string> FleetDatabase::valve(const ValveName& name) {
  const std::string key = name.group + '/' + name.edge + '/' + name.device;
  return valves_.get(key, [&] { return make_valve(name); });
}

json FleetDatabase::asked(const std::function<json(pqxx::transaction_base&)>& ask) {
  const std::lock_guard lock(mutex_);
  try {
    if (!connection_) connection_ = open_database(settings_, kForPage);
    pqxx::read_transaction database(*connection_);
    return ask(database);
  } catch (const std::exception& e) {
    connection_.reset();
    spdlog::warn("the plant's database: {}", first_line(e.what()));
    throw FleetDown(first_line(e.what()));
  }
}

AnswerCache::Answer FleetDatabase::make_overview(const std::string& group) {
  return answer_of(asked([&](pqxx::transaction_base& database) {
    const std::int64_t now = now_ms(database);
    json valves = worst_valves(database, group);
    add_curves(database, valves["list"], now);
    return json{
        {"now_ms", now},
        {"group", group},
        {"groups", groups(database)},
        {"weeks", {{"from_ms", 1000 * kWeeksOfList.from_s(now)}, {"step_s", kWeeksOfList.step_s}}},
        {"faults", faulty_loops(database, group)},
        {"valves", std::move(valves)},
        {"silent", silent_boxes(database, group)},
        {"versions", versions(database, group)},
        {"alarm_rate", rates(database, now)},
        {"alarm_figures", figures(database, group, now)}};
  }));
}

AnswerCache::Answer FleetDatabase::make_valve(const ValveName& name) {
  const json what = asked([&](pqxx::transaction_base& database) {
    return fleet::valve(database, name).value_or(json());
  });
  return what.is_null() ? nullptr : answer_of(what);
}

void FleetDatabase::add_curves(pqxx::transaction_base& database, json& valves,
                               std::int64_t now_ms) {
  const Clock::time_point now = Clock::now();
  std::vector<AlarmName> missing;
  for (const json& valve : valves) {
    AlarmName name{valve["device_id"].get<int>(), valve["alarm"]};
    const auto known = curves_.find(name);
    if (known == curves_.end() || now - known->second.made > kCurvesFresh) {
      missing.push_back(std::move(name));
    }
  }
  if (curves_.size() + missing.size() > kMostCurvesKept) curves_.clear();
  const auto curves = severity_curves(database, missing, kWeeksOfList, now_ms);
  for (std::size_t i = 0; i < missing.size(); ++i) curves_[missing[i]] = {curves[i], now};
  for (json& valve : valves) {
    std::vector<double> curve = curves_[{valve["device_id"].get<int>(), valve["alarm"]}].severity;
    // The history is some minutes old, so the present severity is appended.
    if (!curve.empty() && valve["severity"].is_number()) {
      curve.back() = std::fmax(curve.back(), valve["severity"].get<double>());
    }
    valve["weeks"] = numbers_json(curve);
    valve.erase("device_id");
  }
}

const json& FleetDatabase::versions(pqxx::transaction_base& database, const std::string& group) {
  const auto known = versions_.find(group);
  const Clock::time_point now = Clock::now();
  if (known != versions_.end() && now - known->second.made < kVersionsFresh) {
    return known->second.what;
  }
  if (versions_.size() >= kMostGroupsKept) versions_.clear();
  json what = different_boxes(database, group);
  what["usual"] = usual_versions(database);
  return (versions_[group] = {std::move(what), now}).what;
}

const json& FleetDatabase::figures(pqxx::transaction_base& database, const std::string& group,
                                   std::int64_t now_ms) {
  const auto known = figures_.find(group);
  const Clock::time_point now = Clock::now();
  if (known != figures_.end() && now - known->second.made < kVersionsFresh) {
    return known->second.what;
  }
  if (figures_.size() >= kMostGroupsKept) figures_.clear();
  return (figures_[group] = {day_figures(database, group, now_ms), now}).what;
}

// Only complete bins of 10 minutes count, so the query runs when another bin is complete. After the
// first time it reads the last day only, because boxes send stored values late.
const json& FleetDatabase::rates(pqxx::transaction_base& database, std::int64_t now_ms) {
  const std::int64_t until = now_ms / 1000 / kBin_s;
  if (until == rates_until_) return rates_;
  const std::int64_t oldest = until - kBinsOfWeek;
  const std::int64_t from = std::max(oldest, rates_until_ - kBinsOfDay);
  const auto fresh = raised_between(database, from * kBin_s, until * kBin_s);
  std::erase_if(raised_, [&](const RaisedRow& row) { return row.bin < oldest || row.bin >= from; });
  raised_.insert(raised_.end(), fresh.begin(), fresh.end());
  rates_ = rates_json(alarm_rates(raised_, until), until * kBin_s);
  rates_until_ = until;
  return rates_;
}

}  // namespace loopwarden::fleet
