// SPDX-License-Identifier: Apache-2.0
#include "services/edge/daemon_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/protocol/ask.hpp"

namespace loopwarden::edge {
namespace {

using nlohmann::json;
using protocol::DaemonError;
using sparkplug::Value;

constexpr std::chrono::milliseconds kPatience{3000};

Value number_or_null(double value) { return std::isfinite(value) ? Value{value} : Value{}; }

// `ms`: milliseconds since 1970; 0 means never.
Value date_or_null(std::int64_t ms) {
  return ms > 0 ? Value{static_cast<std::uint64_t>(ms)} : Value{};
}

void put_explanation(const protocol::Explanation& e, Extras& extras) {
  extras["explanation/alarm"] = e.alarm;
  extras["explanation/verdict"] = e.verdict;
  extras["explanation/effect"] = e.effect;
  extras["explanation/sentence"] = e.sentence;
  extras["explanation/remedy"] = e.remedy;
  extras["explanation/size"] = number_or_null(e.size_percent);
  extras["explanation/low"] = number_or_null(e.low_percent);
  extras["explanation/high"] = number_or_null(e.high_percent);
  extras["explanation/confidence"] = number_or_null(e.confidence);
  extras["explanation/gap_closed"] = number_or_null(e.gap_closed);
  extras["explanation/agrees"] = e.agrees;
  extras["explanation/raised"] = date_or_null(e.raised_ms);
}

void put_alarm(const protocol::Alarm& alarm, Extras& extras) {
  const std::string start = "alarm/" + alarm.alarm + '/';
  extras[start + "state"] = alarm.state;
  extras[start + "severity"] = number_or_null(alarm.severity_percent);
  extras[start + "since"] = date_or_null(alarm.raised_ms);
}

void put_incident(const protocol::Incident& incident, Extras& extras) {
  extras["incident/id"] = incident.id;
  extras["incident/name"] = incident.name;
  extras["incident/cause"] = incident.cause;
  extras["incident/confidence"] = number_or_null(incident.confidence);
  extras["incident/active"] = incident.active;
  extras["incident/unacknowledged"] = incident.unacknowledged;
  extras["incident/raised"] =
      date_or_null(static_cast<std::int64_t>(std::llround(1000.0 * incident.raised_s)));
}

// Returns `detectable` of a commission.json: percent of the CO span by name.
std::map<std::string, double> detectable_in(const std::filesystem::path& file) {
  std::map<std::string, double> seen;
  std::ifstream stream(file);
  if (!stream) return seen;
  const json commission = json::parse(stream, nullptr, false);
  const auto detectable = commission.is_object() ? commission.find("detectable") : commission.end();
  if (detectable == commission.end() || !detectable->is_object()) return seen;
  for (const auto& [name, what] : detectable->items()) {
    const auto percent = what.is_object() ? what.find("percent_of_span") : what.end();
    if (percent != what.end() && percent->is_number()) seen.emplace(name, percent->get<double>());
  }
  return seen;
}

}  // namespace

DaemonView::DaemonView(const std::filesystem::path& runtime_directory, DeadBands dead_bands,
                       std::filesystem::path commissions)
    : daemon_((runtime_directory / "status.sock").string(), kPatience),
      dead_bands_(std::move(dead_bands)),
      commissions_(std::move(commissions)) {}

bool DaemonView::look() {
  try {
    bool changed = false;
    if (described_) {
      registers_ = ask(daemon_, protocol::RegistersRequest{.values_only = true});
      // A reload may have changed units and ranges, a restart the loops.
      const bool same = model_.config_hash(registers_) == config_hash_ &&
                        registers_.loops.size() == model_.loops().size();
      if (!same) changed = describe();
    } else {
      changed = describe();
    }
    look_at_alarms();
    look_at_explanations();
    return changed;
  } catch (const DaemonError& e) {
    if (!e.refused()) described_ = false;
    throw;
  } catch (const std::out_of_range& e) {
    described_ = false;
    throw DaemonError(DaemonError::Kind::not_known,
                      fmt::format("unexpected answer of the daemon: {}", e.what()));
  }
}

bool DaemonView::describe() {
  const protocol::Description describe = ask(daemon_, protocol::DescribeRequest{});
  registers_ = ask(daemon_, protocol::RegistersRequest{});
  BoxModel model(registers_, describe, dead_bands_, detectable(describe));
  if (registers_.loops.size() != model.loops().size()) {
    throw DaemonError(DaemonError::Kind::not_known,
                      "registers and describe don't have the same loops");
  }
  config_hash_ = model.config_hash(registers_);
  state_directory_ = describe.state_directory;
  version_ = describe.version;
  const bool changed = !(model == model_);
  model_ = std::move(model);
  extras_.assign(model_.loops().size(), {});
  note_columns();
  described_ = true;
  return changed;
}

BoxModel::Detectable DaemonView::detectable(const protocol::Description& describe) const {
  BoxModel::Detectable all;
  if (commissions_.empty()) return all;
  for (const auto& loop : describe.loops) {
    const std::string& tag = loop.tag;
    // A tag with a slash would lead into another folder.
    if (std::filesystem::path(tag).filename() != tag) continue;
    all[tag] = detectable_in(commissions_ / tag / "commission.json");
  }
  return all;
}

void DaemonView::note_columns() {
  const auto columns = [this](const std::vector<std::string>& fields) {
    std::vector<std::size_t> found;
    for (const std::string& field : fields) {
      if (const auto column = model_.column(field)) found.push_back(*column);
    }
    return found;
  };
  std::vector<std::string> fields;
  for (const std::string& alarm : alarm_names()) {
    fields.push_back("alarm_" + alarm);
    fields.push_back("severity_" + alarm);
  }
  alarm_columns_ = columns(fields);
  explanation_columns_ = columns(
      {"explanation_alarm", "explanation_effect", "explanation_agrees", "explanation_size"});
  alarms_seen_.clear();
  explanations_seen_.assign(model_.loops().size(), {});
}

std::vector<double> DaemonView::values(std::size_t loop,
                                       const std::vector<std::size_t>& columns) const {
  std::vector<double> found;
  for (const std::size_t column : columns) {
    found.push_back(registers_.loops.at(loop).values.at(column));
  }
  return found;
}

void DaemonView::look_at_alarms() {
  // The registers have the sizes of valve alarms. Process alarms have no registers: `alarm_changes`
  // shows only that one of them has changed.
  std::vector<double> now{static_cast<double>(registers_.alarm_changes)};
  for (std::size_t i = 0; i < model_.loops().size(); ++i) {
    const std::vector<double> own = values(i, alarm_columns_);
    now.insert(now.end(), own.begin(), own.end());
  }
  if (protocol::same(now, alarms_seen_)) return;
  std::map<std::string, Extras*> by_tag;
  for (std::size_t i = 0; i < extras_.size(); ++i) by_tag[model_.loops()[i].tag] = &extras_[i];
  const protocol::Alarms all = ask(daemon_, protocol::AlarmsRequest{});
  for (const protocol::Alarm& alarm : all.alarms) {
    if (const auto loop = by_tag.find(alarm.loop); loop != by_tag.end()) {
      put_alarm(alarm, *loop->second);
    }
  }
  for (const protocol::Incident& incident : all.incidents) {
    if (const auto loop = by_tag.find(incident.loop); loop != by_tag.end()) {
      put_incident(incident, *loop->second);
    }
  }
  alarms_seen_ = std::move(now);
}

void DaemonView::look_at_explanations() {
  for (std::size_t i = 0; i < extras_.size(); ++i) {
    std::vector<double> now = values(i, explanation_columns_);
    if (explanations_seen_[i] && protocol::same(now, *explanations_seen_[i])) continue;
    const auto loop = ask(daemon_, protocol::LoopRequest{model_.loops()[i].tag});
    if (loop.explanation) put_explanation(*loop.explanation, extras_[i]);
    explanations_seen_[i] = std::move(now);
  }
}

Reading DaemonView::node_reading(const Extras& own) const {
  Extras all = own;
  if (!version_.empty()) all["version"] = version_;
  return model_.node_reading(described_ ? &registers_ : nullptr, all);
}

Reading DaemonView::loop_reading(std::size_t loop) const {
  return model_.loop_reading(loop, registers_, extras_.at(loop));
}

std::vector<std::string> DaemonView::unacknowledged(std::size_t loop) const {
  std::vector<std::string> waiting;
  for (const std::string& alarm : alarm_names()) {
    const auto state = extras_.at(loop).find("alarm/" + alarm + "/state");
    const auto* text =
        state == extras_.at(loop).end() ? nullptr : std::get_if<std::string>(&state->second);
    if (text != nullptr && text->find("unacknowledged") != std::string::npos)
      waiting.push_back(alarm);
  }
  return waiting;
}

std::optional<std::filesystem::path> DaemonView::evidence(std::size_t loop,
                                                          const std::string& wanted) {
  const std::string& tag = model_.loops().at(loop).tag;
  const auto& alarms = alarm_names();
  if (std::find(alarms.begin(), alarms.end(), wanted) != alarms.end()) {
    const auto answer = ask(daemon_, protocol::ExplainRequest{tag, wanted});
    // While the disk does not answer, the outcome is unknown: the host can ask again.
    if (!answer.disk_answers) throw std::runtime_error("the box's disk does not answer");
    return answer.evidence;
  }
  // Accepts only a plain folder name, of this loop.
  if (wanted.empty() || wanted.front() == '.' ||
      std::filesystem::path(wanted).filename() != wanted) {
    return std::nullopt;
  }
  const std::filesystem::path folder = state_directory_ / "evidence" / wanted;
  std::ifstream file(folder / "evidence.json");
  const json evidence = file ? json::parse(file, nullptr, false) : json();
  const bool own = evidence.is_object() && evidence.value("loop", std::string()) == tag;
  return own ? std::optional(folder) : std::nullopt;
}

}  // namespace loopwarden::edge
