// SPDX-License-Identifier: Apache-2.0
#include "services/edge/box_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "model/alarm/alarm_kind.hpp"
#include "services/net/sparkplug/topic.hpp"

namespace loopwarden::edge {
namespace {

using sparkplug::DataType;
using sparkplug::Value;

// Metrics that change in every cycle or second. The time of each message has the same information.
const std::set<std::string> kSlow{
    "heartbeat",     "uptime",      "utc_seconds",     "utc_milliseconds", "sequence_head",
    "sequence_tail", "pv_age",      "hours_automatic", "hours_manual",     "hours_at_limit",
    "wake_up_worst", "wake_up_p99", "windows_judged",  "window_number",    "explanation_age"};

// Metrics with the loop's own range, whatever the register can hold.
const std::set<std::string> kOfPv{"pv", "sp"};
const std::set<std::string> kOfCo{"co", "stem", "output"};

// Commands to the controller. A watched loop keeps mode and sp, because they also show its state.
const std::set<std::string> kOrdersToController{"output", "output_scaled", "veto_corrective_action",
                                                "calm_stiction"};

// Commands of a Modbus master for several alarms at once. A host names each alarm.
const std::set<std::string> kOfMasters{"acknowledge_process", "unshelve_process"};

struct RegisterKind {
  DataType type;
  double low;
  double high;
};

RegisterKind kind_of(const std::string& name) {
  if (name == "bool") return {DataType::boolean, 0.0, 1.0};
  if (name == "u16") return {DataType::uint16, 0.0, 65535.0};
  if (name == "i16") return {DataType::int16, -32768.0, 32767.0};
  // Not UInt32: the specification makes that an int_value, and clients in use expect a long_value.
  if (name == "u32") return {DataType::uint64, 0.0, 4294967295.0};
  if (name == "i32") return {DataType::int32, -2147483648.0, 2147483647.0};
  return {DataType::float32, 0.0, 0.0};
}

double dead_band_of(const std::string& name, const DeadBands& bands) {
  const auto own = bands.by_metric.find(name);
  return own == bands.by_metric.end() ? bands.percent : own->second;
}

// Returns the spec of one field of the map. A register with a scale becomes a Float32 metric.
MetricSpec spec_of(const protocol::Field& field, const DeadBands& bands) {
  MetricSpec spec;
  spec.name = field.name;
  spec.unit = field.unit;
  spec.slow = kSlow.contains(spec.name);
  const RegisterKind kind = kind_of(field.type);
  spec.type = kind.type;
  if (spec.type == DataType::boolean || !std::isfinite(field.high)) {
    if (spec.type == DataType::float32) spec.dead_band_percent = dead_band_of(spec.name, bands);
    return spec;
  }
  if (field.high != kind.high) {
    spec.type = DataType::float32;
    // A quantity in percent has the range 0 to 100.
    spec.low = 0.0;
    spec.high = spec.unit.starts_with('%') ? 100.0 : field.high;
    spec.dead_band_percent = dead_band_of(spec.name, bands);
  }
  return spec;
}

Value value_of(double value, DataType type) {
  if (!std::isfinite(value)) return {};
  if (type == DataType::boolean) return value != 0.0;
  if (sparkplug::is_unsigned(type)) return static_cast<std::uint64_t>(value);
  if (sparkplug::is_signed(type)) return static_cast<std::int64_t>(value);
  return static_cast<double>(static_cast<float>(value));
}

// Returns a unit such as "CO/(PV s)" with the loop's own units. A share of a span keeps its unit.
std::string unit_of_loop(const std::string& unit, const std::string& pv, const std::string& co) {
  if (unit.starts_with('%')) return unit;
  std::string text;
  for (std::size_t i = 0; i < unit.size();) {
    const std::string_view two = std::string_view(unit).substr(i, 2);
    if (two == "PV" || two == "CO") {
      text += two == "PV" ? pv : co;
      i += 2;
    } else {
      text += unit[i++];
    }
  }
  return text;
}

MetricSpec plain(std::string name, DataType type, std::string unit = "") {
  MetricSpec spec;
  spec.name = std::move(name);
  spec.type = type;
  spec.unit = std::move(unit);
  return spec;
}

constexpr const char* kOfSpan = "% of CO span";

void add_explanation(std::vector<MetricSpec>& specs) {
  for (const char* name : {"alarm", "verdict", "effect", "sentence", "remedy"}) {
    specs.push_back(plain(std::string("explanation/") + name, DataType::string));
  }
  for (const char* name : {"size", "low", "high"}) {
    specs.push_back(plain(std::string("explanation/") + name, DataType::float64, kOfSpan));
  }
  specs.push_back(plain("explanation/confidence", DataType::float64));
  specs.push_back(plain("explanation/gap_closed", DataType::float64));
  specs.push_back(plain("explanation/agrees", DataType::boolean));
  specs.push_back(plain("explanation/raised", DataType::date_time));
}

void add_incident(std::vector<MetricSpec>& specs) {
  for (const char* name : {"id", "name", "cause"}) {
    specs.push_back(plain(std::string("incident/") + name, DataType::string));
  }
  specs.push_back(plain("incident/confidence", DataType::float64));
  specs.push_back(plain("incident/active", DataType::boolean));
  specs.push_back(plain("incident/unacknowledged", DataType::boolean));
  specs.push_back(plain("incident/raised", DataType::date_time));
}

// Adds the metrics of a loop that have no register.
void add_extras(std::vector<MetricSpec>& specs) {
  for (const char* name : {"tag", "area", "description"}) {
    specs.push_back(plain(name, DataType::string));
  }
  for (const std::string& alarm : alarm_names()) {
    specs.push_back(plain("alarm/" + alarm + "/state", DataType::string));
    specs.push_back(plain("alarm/" + alarm + "/since", DataType::date_time));
  }
  // Process alarms have no size.
  for (const alarm::AlarmKind kind : alarm::kValveAlarms) {
    specs.push_back(
        plain(fmt::format("alarm/{}/severity", to_text(kind)), DataType::float64, kOfSpan));
  }
  add_explanation(specs);
  add_incident(specs);
  specs.push_back(plain("order/result", DataType::string));
  specs.push_back(plain("request/evidence", DataType::string));
  for (const std::string& file : evidence_files()) {
    specs.push_back(plain("file/" + file, DataType::file));
  }
}

// Returns the metrics of the edge node itself.
std::vector<MetricSpec> own_specs() {
  MetricSpec rebirth = plain("Node Control/Rebirth", DataType::boolean);
  rebirth.aliased = false;
  MetricSpec waiting = plain("store/waiting", DataType::uint64);
  waiting.slow = true;
  return {
      plain("bdSeq", DataType::int64),           rebirth, plain("version", DataType::string),
      plain("daemon/online", DataType::boolean), waiting, plain("store/dropped", DataType::uint64)};
}

void put(const std::vector<MetricSpec>& specs, const Extras& extras, Reading& reading) {
  for (std::size_t i = 0; i < specs.size(); ++i) {
    if (const auto own = extras.find(specs[i].name); own != extras.end())
      reading.items[i].value = own->second;
  }
}

// Adds a second metric condition/valve for condition_valve, and likewise for the others.
void add_conditions(std::vector<MetricSpec>& specs,
                    std::vector<std::pair<std::size_t, std::size_t>>& pairs) {
  constexpr std::string_view kPrefix = "condition_";
  const std::size_t fields = specs.size();
  for (std::size_t i = 0; i < fields; ++i) {
    if (!specs[i].name.starts_with(kPrefix)) continue;
    MetricSpec one = specs[i];
    one.name = "condition/" + one.name.substr(kPrefix.size());
    pairs.emplace_back(i, specs.size());
    specs.push_back(std::move(one));
  }
}

// Returns the tag as a topic may hold it, with a number if another tag already has that name.
std::string unique_device(const std::string& tag, std::set<std::string>& taken) {
  const std::string name = sparkplug::identifier_of(tag);
  std::string device = name;
  for (int n = 2; !taken.insert(device).second; ++n) device = fmt::format("{}_{}", name, n);
  return device;
}

const std::vector<protocol::Field>& names_of(const protocol::Registers& registers) {
  if (!registers.names) throw std::out_of_range("registers without names");
  return *registers.names;
}

template <class T>
void leave_out(const std::vector<std::size_t>& ascending, std::vector<T>& all) {
  for (auto index = ascending.rbegin(); index != ascending.rend(); ++index)
    all.erase(all.begin() + static_cast<std::ptrdiff_t>(*index));
}

void set_range(MetricSpec& spec, const protocol::Range& range) {
  spec.low = range[0];
  spec.high = range[1];
}

// Returns the specs of all loops with units and ranges of this loop.
std::vector<MetricSpec> specs_of_loop(std::vector<MetricSpec> specs,
                                      const protocol::LoopDescription& loop) {
  for (MetricSpec& spec : specs) {
    spec.unit = unit_of_loop(spec.unit, loop.pv_unit, loop.co_unit);
    if (kOfPv.contains(spec.name)) set_range(spec, loop.pv_range);
    if (kOfCo.contains(spec.name)) set_range(spec, loop.co_range);
  }
  return specs;
}

}  // namespace

const std::vector<std::string>& evidence_files() {
  static const std::vector<std::string> kFiles{"evidence.json", "record.csv",       "minutes.csv",
                                               "twin.yaml",     "explanation.json", "report.html"};
  return kFiles;
}

const std::vector<std::string>& alarm_names() {
  static const std::vector<std::string> kAlarms = [] {
    std::vector<std::string> all;
    for (const alarm::AlarmKind kind : alarm::kAlarmKinds) all.emplace_back(to_text(kind));
    return all;
  }();
  return kAlarms;
}

BoxModel::Area BoxModel::take_names(const std::vector<protocol::Field>& names, const char* area,
                                    const DeadBands& bands) const {
  Area taken;
  std::map<std::string, std::size_t> known;
  std::size_t column = 0;
  for (const protocol::Field& field : names) {
    if (field.area != area) continue;
    if (kOfMasters.contains(field.name)) {
      ++column;
      continue;
    }
    MetricSpec spec = spec_of(field, bands);
    const bool scaled = field.type == "i16" && spec.type == DataType::float32;
    if (known.emplace(spec.name, taken.specs.size()).second) {
      taken.columns.push_back({column, taken.specs.size(), scaled});
      taken.specs.push_back(std::move(spec));
    }
    ++column;
  }
  return taken;
}

BoxModel::BoxModel() : node_specs_(own_specs()) {}

BoxModel::BoxModel(const protocol::Registers& registers, const protocol::Description& describe,
                   const DeadBands& dead_bands, const Detectable& detectable)
    : box_(take_names(names_of(registers), "box", dead_bands)),
      loop_(take_names(names_of(registers), "loop", dead_bands)),
      node_specs_(own_specs()) {
  node_specs_.insert(node_specs_.end(), box_.specs.begin(), box_.specs.end());
  for (std::size_t i = 0; i < loop_.specs.size(); ++i) {
    if (kOrdersToController.contains(loop_.specs[i].name)) orders_.push_back(i);
  }
  std::vector<MetricSpec> common = loop_.specs;
  add_conditions(common, conditions_);
  add_extras(common);
  std::set<std::string> taken;
  for (const protocol::LoopDescription& loop : describe.loops) {
    LoopModel model;
    model.tag = loop.tag;
    model.device = unique_device(model.tag, taken);
    model.watched = loop.control == "elsewhere";
    model.specs = specs_of_loop(common, loop);
    if (model.watched) leave_out(orders_, model.specs);
    model.fixed = {{"tag", model.tag},
                   {"area", loop.area},
                   {"description", loop.description},
                   {"request/evidence", std::string()},
                   {"order/result", std::string()}};
    if (const auto sees = detectable.find(model.tag); sees != detectable.end()) {
      for (const auto& [name, percent] : sees->second) {
        model.specs.push_back(plain("detectable/" + name, DataType::float64, kOfSpan));
        model.fixed.emplace("detectable/" + name, percent);
      }
    }
    loops_.push_back(std::move(model));
  }
}

const LoopModel* BoxModel::find(const std::string& device) const noexcept {
  const auto found = std::find_if(loops_.begin(), loops_.end(),
                                  [&](const LoopModel& loop) { return loop.device == device; });
  return found == loops_.end() ? nullptr : &*found;
}

void BoxModel::take_values(const Area& area, const std::vector<double>& values,
                           Reading::Item* first) {
  constexpr double kNotThere = -327.68;  // the lowest of a scaled i16
  for (const Column& column : area.columns) {
    const double value = values.at(column.column);
    const bool there = !column.scaled || value != kNotThere;
    if (there) first[column.metric].value = value_of(value, area.specs[column.metric].type);
  }
}

Reading BoxModel::node_reading(const protocol::Registers* registers, const Extras& extras) const {
  Reading now;
  now.items.resize(node_specs_.size());
  if (registers != nullptr) {
    take_values(box_, registers->box, now.items.data() + (node_specs_.size() - box_.specs.size()));
  }
  put(node_specs_, extras, now);
  return now;
}

Reading BoxModel::loop_reading(std::size_t loop, const protocol::Registers& registers,
                               const Extras& extras) const {
  const LoopModel& model = loops_.at(loop);
  Reading now;
  now.items.resize(model.specs.size() + (model.watched ? orders_.size() : 0));
  const std::vector<double>& values = registers.loops.at(loop).values;
  take_values(loop_, values, now.items.data());
  const std::optional<std::size_t> quality = column("pv_quality");
  const bool good = !quality || values.at(*quality) != 0;
  for (std::size_t i = 0; i < loop_.specs.size(); ++i) {
    const std::string& name = loop_.specs[i].name;
    if (name == "pv" || name == "pv_scaled") now.items[i].good = good;
  }
  for (const auto& [from, to] : conditions_) now.items[to] = now.items[from];
  if (model.watched) leave_out(orders_, now.items);
  put(model.specs, model.fixed, now);
  put(model.specs, extras, now);
  return now;
}

std::optional<double> BoxModel::config_hash(const protocol::Registers& registers) const {
  for (const Column& column : box_.columns) {
    if (box_.specs[column.metric].name == "config_hash") return registers.box.at(column.column);
  }
  return std::nullopt;
}

std::optional<std::size_t> BoxModel::column(const std::string& field) const noexcept {
  for (const Column& column : loop_.columns) {
    if (loop_.specs[column.metric].name == field) return column.column;
  }
  return std::nullopt;
}

}  // namespace loopwarden::edge
