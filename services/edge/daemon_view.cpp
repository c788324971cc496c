// SPDX-License-Identifier: Apache-2.0
#include "services/edge/daemon_view.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <utility>

namespace loopwarden::edge {
namespace {

using nlohmann::json;
using sparkplug::Value;

constexpr std::chrono::milliseconds kPatience{3000};

Value text_or_null(const json& object, const char* key) {
  const auto it = object.find(key);
  return it == object.end() || !it->is_string() ? Value{} : Value{it->get<std::string>()};
}

Value number_or_null(const json& object, const char* key) {
  const auto it = object.find(key);
  return it == object.end() || !it->is_number() ? Value{} : Value{it->get<double>()};
}

// Milliseconds since 1970; 0 is never.
Value date_or_null(const json& object, const char* key) {
  const auto it = object.find(key);
  const bool there = it != object.end() && it->is_number_integer() && it->get<std::int64_t>() > 0;
  return there ? Value{it->get<std::uint64_t>()} : Value{};
}

void put_explanation(const json& e, Extras& extras) {
  for (const char* name : {"alarm", "verdict", "effect", "sentence", "remedy"}) {
    extras[std::string("explanation/") + name] = text_or_null(e, name);
  }
  extras["explanation/size"] = number_or_null(e, "size_percent");
  extras["explanation/low"] = number_or_null(e, "low_percent");
  extras["explanation/high"] = number_or_null(e, "high_percent");
  extras["explanation/confidence"] = number_or_null(e, "confidence");
  extras["explanation/gap_closed"] = number_or_null(e, "gap_closed");
  extras["explanation/agrees"] = e.value("agrees", false);
  extras["explanation/raised"] = date_or_null(e, "raised_ms");
}

void put_alarm(const json& alarm, Extras& extras) {
  const std::string start = "alarm/" + alarm.at("alarm").get<std::string>() + '/';
  extras[start + "state"] = text_or_null(alarm, "state");
  extras[start + "severity"] = number_or_null(alarm, "severity_percent");
  extras[start + "since"] = date_or_null(alarm, "raised_ms");
}

// detectable of a commission.json: percent of the CO span by name.
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
    : link_((runtime_directory / "status.sock").string(), kPatience),
      dead_bands_(std::move(dead_bands)),
      commissions_(std::move(commissions)) {}

bool DaemonView::look() {
  try {
    bool changed = false;
    if (described_) {
      registers_ = link_.ask({{"request", "registers"}, {"values_only", true}});
      // A reload may have changed units and ranges, a restart the loops.
      const bool same = model_.config_hash(registers_) == config_hash_ &&
                        registers_.at("loops").size() == model_.loops().size();
      if (!same) changed = describe();
    } else {
      changed = describe();
    }
    look_at_alarms();
    look_at_explanations();
    return changed;
  } catch (const DaemonAway&) {
    described_ = false;
    throw;
  } catch (const json::exception& e) {
    described_ = false;
    throw DaemonRefused(
        fmt::format("status.sock answers in another way than expected: {}", e.what()));
  }
}

bool DaemonView::describe() {
  const json describe = link_.ask({{"request", "describe"}});
  registers_ = link_.ask({{"request", "registers"}});
  BoxModel model(registers_, describe, dead_bands_, detectable(describe));
  if (registers_.at("loops").size() != model.loops().size()) {
    throw DaemonRefused("registers and describe don't have the same loops");
  }
  config_hash_ = model.config_hash(registers_);
  state_directory_ = describe.at("state_directory").get<std::string>();
  version_ = describe.at("version").get<std::string>();
  const bool changed = !(model == model_);
  model_ = std::move(model);
  extras_.assign(model_.loops().size(), {});
  note_columns();
  described_ = true;
  return changed;
}

BoxModel::Detectable DaemonView::detectable(const json& describe) const {
  BoxModel::Detectable all;
  if (commissions_.empty()) return all;
  for (const json& loop : describe.at("loops")) {
    const auto tag = loop.at("tag").get<std::string>();
    // A tag with a slash would lead elsewhere.
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
  alarms_seen_ = nullptr;
  explanations_seen_.assign(model_.loops().size(), nullptr);
}

json DaemonView::values(std::size_t loop, const std::vector<std::size_t>& columns) const {
  json found = json::array();
  const json& all = registers_.at("loops").at(loop).at("values");
  for (const std::size_t column : columns) found.push_back(all.at(column));
  return found;
}

void DaemonView::look_at_alarms() {
  // The registers have sizes, but no process alarms: of those it is only told that something has changed.
  json now = json::array({registers_.value("alarm_changes", json())});
  for (std::size_t i = 0; i < model_.loops().size(); ++i) now.push_back(values(i, alarm_columns_));
  if (now == alarms_seen_) return;
  std::map<std::string, Extras*> by_tag;
  for (std::size_t i = 0; i < extras_.size(); ++i) by_tag[model_.loops()[i].tag] = &extras_[i];
  const json answer = link_.ask({{"request", "alarms"}});
  for (const json& alarm : answer.at("alarms")) {
    const auto loop = by_tag.find(alarm.at("loop").get<std::string>());
    if (loop != by_tag.end()) put_alarm(alarm, *loop->second);
  }
  alarms_seen_ = std::move(now);
}

void DaemonView::look_at_explanations() {
  for (std::size_t i = 0; i < extras_.size(); ++i) {
    json now = values(i, explanation_columns_);
    if (now == explanations_seen_[i]) continue;
    const json loop = link_.ask({{"request", "loop"}, {"loop", model_.loops()[i].tag}});
    const json& explanation = loop.at("explanation");
    if (explanation.is_object()) put_explanation(explanation, extras_[i]);
    explanations_seen_[i] = std::move(now);
  }
}

Reading DaemonView::node_reading(const Extras& own) const {
  Extras all = own;
  if (!version_.empty()) all["version"] = version_;
  return model_.node_reading(described_ ? registers_ : json(nullptr), all);
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
    const json answer = link_.ask({{"request", "explain"}, {"loop", tag}, {"alarm", wanted}});
    // The host asks again where nobody knows.
    if (!answer.value("disk_answers", true)) {
      throw std::runtime_error("the box's disk does not answer");
    }
    const auto folder = answer.find("evidence");
    if (folder == answer.end() || !folder->is_string()) return std::nullopt;
    return folder->get<std::string>();
  }
  // A name, and nothing that leads elsewhere; of this loop.
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
