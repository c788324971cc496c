// SPDX-License-Identifier: Apache-2.0
// status.sock and edge.sock with scripted answers: a register map of a few fields, with any number
// of loops and values set by the test. For tests of the daemon's clients. The tests of closed_loop
// use the real daemon.
#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <map>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/local_server.hpp"
#include "base/thread.hpp"

namespace loopwarden::tests {

class FakeDaemon {
 public:
  using json = nlohmann::json;

  FakeDaemon(std::filesystem::path folder, std::vector<std::string> tags)
      : folder_(std::move(folder)), tags_(std::move(tags)) {
    for (const std::string& tag : tags_) loops_[tag] = first_values();
    start();
  }
  FakeDaemon(const FakeDaemon&) = delete;
  FakeDaemon& operator=(const FakeDaemon&) = delete;
  ~FakeDaemon() { stop(); }

  void start() {
    quit_ = false;
    thread_.start({.name = "fake-daemon", .stack_bytes = 1024UL * 1024UL}, [this] { run(); });
    while (!there_) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  void stop() {
    quit_ = true;
    thread_.join();
    there_ = false;
  }

  void set(const std::string& tag, const std::string& field, json value) {
    const std::lock_guard lock(mutex_);
    loops_.at(tag).at(field) = std::move(value);
  }
  void set_box(const std::string& field, json value) {
    const std::lock_guard lock(mutex_);
    box_.at(field) = std::move(value);
  }
  void set_alarm(const std::string& tag, json alarm) {
    const std::lock_guard lock(mutex_);
    alarms_[tag] = std::move(alarm);
    ++alarm_changes_;
  }
  void set_incident(json incident) {
    const std::lock_guard lock(mutex_);
    incidents_ = json::array({std::move(incident)});
    ++alarm_changes_;
  }
  void set_explanation(const std::string& tag, json explanation) {
    const std::lock_guard lock(mutex_);
    explanations_[tag] = std::move(explanation);
  }
  void set_evidence(std::filesystem::path folder) {
    const std::lock_guard lock(mutex_);
    evidence_ = std::move(folder);
  }
  void set_unit(std::string unit) {
    const std::lock_guard lock(mutex_);
    pv_unit_ = std::move(unit);
  }
  // Another controller runs the loop. Call it before the first describe.
  void set_elsewhere(std::string tag) {
    const std::lock_guard lock(mutex_);
    elsewhere_ = std::move(tag);
  }
  // The answer to a command. Empty: done.
  void refuse_orders(std::string why) {
    const std::lock_guard lock(mutex_);
    refusal_ = std::move(why);
  }
  std::vector<json> orders() const {
    const std::lock_guard lock(mutex_);
    return orders_;
  }
  // Returns the number of requests on status.sock since the start.
  std::size_t looks() const { return looks_; }

 private:
  struct FieldText {
    const char* name;
    const char* area;
    const char* unit;
    const char* type;
    bool writable;
    double low;
    double high;
  };
  static const std::vector<FieldText>& fields() {
    static const std::vector<FieldText> kFields{
        {"heartbeat", "box", "", "u16", false, 0, 65535},
        {"config_hash", "box", "", "u32", false, 0, 4294967295.0},
        {"running", "box", "", "bool", false, 0, 1},
        {"acknowledge_all", "box", "", "bool", true, 0, 1},
        {"sequence_head", "loop", "", "u16", false, 0, 65535},
        {"mode", "loop", "", "u16", false, 0, 65535},
        {"pv_quality", "loop", "", "u16", false, 0, 65535},
        {"sp", "loop", "PV", "f32", false, 0, 0},
        {"pv", "loop", "PV", "f32", false, 0, 0},
        {"co", "loop", "CO", "f32", false, 0, 0},
        {"pv_scaled", "loop", "% of PV span", "i16", false, -327.68, 327.67},
        {"severity_stiction", "loop", "% of CO span", "u16", false, 0, 655.35},
        {"alarm_stiction", "loop", "", "u16", false, 0, 65535},
        {"condition_valve", "loop", "%", "i16", false, -327.68, 327.67},
        {"explanation_alarm", "loop", "", "u16", false, 0, 65535},
        {"mode", "loop", "", "u16", true, 0, 65535},
        {"sp", "loop", "PV", "f32", true, 0, 0},
        {"output", "loop", "CO", "f32", true, 0, 0},
        {"ki", "loop", "CO/(PV s)", "f32", true, 0, 0},
        {"shelve_stiction", "loop", "min", "u16", true, 0, 65535},
        {"acknowledge_stiction", "loop", "", "bool", true, 0, 1},
        {"veto_corrective_action", "loop", "", "bool", true, 0, 1}};
    return kFields;
  }
  static std::map<std::string, json> first_values() {
    std::map<std::string, json> values;
    for (const FieldText& field : fields()) values[field.name] = 0;
    values["mode"] = 1;
    values["pv_quality"] = 192;
    values["sp"] = 5.0;
    values["pv"] = 5.0;
    values["co"] = 50.0;
    values["condition_valve"] = -327.68;
    return values;
  }

  void run() {
    base::LocalServer server;
    const auto listen = [&](const char* name, bool orders) {
      server.listen(
          {.path = (folder_ / name).string()},
          [this, orders](std::string_view line, unsigned) { return answer(line, orders); });
    };
    listen("status.sock", false);
    listen("edge.sock", true);
    there_ = true;
    while (!quit_) server.serve(std::chrono::milliseconds(20));
  }

  std::string answer(std::string_view line, bool order) {
    const std::lock_guard lock(mutex_);
    const json request = json::parse(line);
    json all = order ? take_order(request) : read(request);
    if (!all.contains("ok")) all["ok"] = true;
    return all.dump();
  }
  json take_order(const json& request) {
    if (request.at("request") == "order")
      return {{"state", "done"}, {"why", ""}, {"on_disk", true}};
    orders_.push_back(request);
    if (!refusal_.empty()) return {{"ok", false}, {"error", refusal_}};
    if (request.at("request") == "set") return {{"order", orders_.size()}, {"sample_time_s", 0.1}};
    if (request.at("request") == "acknowledge_all") return acknowledge_all();
    return {{"on_disk", true}};
  }
  json acknowledge_all() const {
    json done = json::array();
    for (const auto& [tag, alarm] : alarms_) {
      if (alarm.at("state") != "unacknowledged") continue;
      done.push_back({{"loop", tag}, {"alarm", alarm.at("alarm")}});
    }
    return {{"acknowledged", std::move(done)}, {"on_disk", true}};
  }
  json read(const json& request) {
    ++looks_;
    const auto what = request.at("request").get<std::string>();
    if (what == "describe") return describe();
    if (what == "registers") return registers(request.value("values_only", false));
    if (what == "alarms") return alarms();
    if (what == "explain")
      return {{"evidence", evidence_.empty() ? json(nullptr) : json(evidence_.string())}};
    if (what == "loop") {
      const auto found = explanations_.find(request.at("loop").get<std::string>());
      return {{"name", request.at("loop")},
              {"explanation", found == explanations_.end() ? json(nullptr) : found->second}};
    }
    return {{"ok", false}, {"error", "no such request: " + what}};
  }
  json describe() const {
    json loops = json::array();
    for (const std::string& tag : tags_) {
      loops.push_back({{"tag", tag},
                       {"control", tag == elsewhere_ ? "elsewhere" : "here"},
                       {"area", "Utilities"},
                       {"pv_unit", pv_unit_},
                       {"co_unit", "%"},
                       {"pv_range", {0.0, 10.0}},
                       {"co_range", {0.0, 100.0}}});
    }
    return {{"version", "1.2.3"},
            {"config_hash", box_.at("config_hash")},
            {"state_directory", folder_.string()},
            {"edge", {{"control", true}, {"alarms", true}}},
            {"loops", std::move(loops)}};
  }
  json registers(bool values_only) const {
    json answer{
        {"alarm_changes", alarm_changes_}, {"box", json::array()}, {"loops", json::array()}};
    if (!values_only) answer["names"] = json::array();
    for (const FieldText& f : fields()) {
      const bool bounded = f.high != 0.0;
      if (!values_only) {
        answer["names"].push_back({{"name", f.name},
                                   {"area", f.area},
                                   {"unit", f.unit},
                                   {"type", f.type},
                                   {"writable", f.writable},
                                   {"low", bounded ? json(f.low) : json(nullptr)},
                                   {"high", bounded ? json(f.high) : json(nullptr)}});
      }
      if (std::string(f.area) == "box") answer["box"].push_back(box_.at(f.name));
    }
    for (const std::string& tag : tags_) {
      json values = json::array();
      for (const FieldText& f : fields()) {
        if (std::string(f.area) == "loop") values.push_back(loops_.at(tag).at(f.name));
      }
      answer["loops"].push_back({{"tag", tag}, {"values", std::move(values)}});
    }
    return answer;
  }
  json alarms() const {
    json all = json::array();
    for (const auto& [tag, alarm] : alarms_) {
      json one = alarm;
      one["loop"] = tag;
      all.push_back(std::move(one));
    }
    return {{"now_ms", 0}, {"alarms", std::move(all)}, {"incidents", incidents_}};
  }

  std::filesystem::path folder_;
  std::vector<std::string> tags_;
  mutable std::mutex mutex_;
  std::map<std::string, json> box_{
      {"heartbeat", 0}, {"config_hash", 77}, {"running", 1}, {"acknowledge_all", 0}};
  std::map<std::string, std::map<std::string, json>> loops_;
  std::map<std::string, json> alarms_;
  json incidents_ = json::array();
  int alarm_changes_ = 0;
  std::map<std::string, json> explanations_;
  std::filesystem::path evidence_;
  std::string pv_unit_ = "L/min";
  std::string elsewhere_;
  std::string refusal_;
  std::vector<json> orders_;
  std::atomic<std::size_t> looks_{0};
  std::atomic<bool> quit_{false};
  std::atomic<bool> there_{false};
  base::Thread thread_;
};

}  // namespace loopwarden::tests
