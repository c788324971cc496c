// SPDX-License-Identifier: Apache-2.0
#include "config/reload.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace loopwarden::config {
namespace {

constexpr const char* kRestart = "the new value needs a restart";

class List {
 public:
  explicit List(std::string file) : file_(std::move(file)) {}
  void add(std::string key, std::string why = kRestart) {
    all_.push_back({file_, std::move(key), std::move(why)});
  }
  void add_if(bool differs, const char* key, const char* why = kRestart) {
    if (differs) add(key, why);
  }
  std::vector<Waiting> take() { return std::move(all_); }

 private:
  std::string file_;
  std::vector<Waiting> all_;
};

struct Range {
  double low = 0.0;
  double high = 0.0;
  friend bool operator==(const Range&, const Range&) = default;
};

Range pv_range(const LoopConfig& loop) { return {loop.pv.low, loop.pv.high}; }
Range co_range(const LoopConfig& loop) {
  return {loop.controller.pid.output_low, loop.controller.pid.output_high};
}

// A value of `io` that follows from another key in both states is no change of `io`.
template <class T>
void disregard(T& a, T& b, const T& a_follows, const T& b_follows) {
  if (a == a_follows && b == b_follows) a = b;
}

template <class Stage>
void disregard_range(Stage& a, Stage& b, const Range& a_follows, const Range& b_follows) {
  if (Range{a.low, a.high} != a_follows || Range{b.low, b.high} != b_follows) return;
  a.low = b.low;
  a.high = b.high;
}

std::int64_t period_ns(const LoopConfig& loop) { return std::llround(loop.sample_time_s * 1e9); }

void disregard_derived(hal::modbus::LoopModbusSettings& a, hal::modbus::LoopModbusSettings& b,
                       const LoopConfig& running, const LoopConfig& wanted) {
  // What a link is stands in loopwardend.yaml; here is which one it is.
  for (hal::modbus::LoopModbusSettings* io : {&a, &b}) {
    for (hal::modbus::LinkSettings* link : {&io->transmitter_link, &io->positioner_link}) {
      hal::modbus::LinkSettings named;
      named.name = link->name;
      *link = std::move(named);
    }
  }
  disregard_range(a.output, b.output, co_range(running), co_range(wanted));
  disregard(a.poll_period_ns, b.poll_period_ns, period_ns(running), period_ns(wanted));
}

void disregard_derived(hal::iio::AnalogSettings& a, hal::iio::AnalogSettings& b,
                       const LoopConfig& running, const LoopConfig& wanted) {
  disregard_range(a.process_variable, b.process_variable, pv_range(running), pv_range(wanted));
  disregard_range(a.output, b.output, co_range(running), co_range(wanted));
  if (a.read_back && b.read_back) {
    disregard_range(*a.read_back, *b.read_back, co_range(running), co_range(wanted));
  }
  disregard(a.poll_period_ns, b.poll_period_ns, period_ns(running), period_ns(wanted));
}

void disregard_derived(hal::replay::ReplaySettings& a, hal::replay::ReplaySettings& b,
                       const LoopConfig& running, const LoopConfig& wanted) {
  disregard(a.sample_time_s, b.sample_time_s, running.sample_time_s, wanted.sample_time_s);
  if (Range{a.output_low, a.output_high} == co_range(running) &&
      Range{b.output_low, b.output_high} == co_range(wanted)) {
    a.output_low = b.output_low;
    a.output_high = b.output_high;
  }
}

void disregard_derived(SimIo&, SimIo&, const LoopConfig&, const LoopConfig&) {}

void compare_io(const LoopConfig& running, const LoopConfig& wanted, List& list) {
  if (running.io.index() != wanted.io.index()) {
    list.add("io.backend");
    return;
  }
  std::visit(
      [&](const auto& was) {
        using Settings = std::decay_t<decltype(was)>;
        Settings a = was;
        Settings b = std::get<Settings>(wanted.io);
        if constexpr (std::is_same_v<Settings, SimIo>) {
          list.add_if(a.model != b.model, "io.model", "the new content of it needs a restart");
          a.model = b.model;
        }
        disregard_derived(a, b, running, wanted);
        list.add_if(!(a == b), "io");
      },
      running.io);
}

void compare(const LoopConfig& running, const LoopConfig& wanted, List& list) {
  constexpr const char* kRange =
      "in force for control, checks, top and registers; the monitor's windows and the scaling of "
      "io keep the old one until a restart";
  list.add_if(running.description != wanted.description, "description");
  list.add_if(running.sample_time_s != wanted.sample_time_s, "sample_time");
  list.add_if(running.pv_unit != wanted.pv_unit, "process_variable.unit");
  list.add_if(pv_range(running) != pv_range(wanted), "process_variable.range", kRange);
  list.add_if(running.co_unit != wanted.co_unit, "controller.output.unit");
  list.add_if(co_range(running) != co_range(wanted), "controller.output.range", kRange);
  list.add_if(running.valve_position != wanted.valve_position, "controller.jacket.valve_position");
  const bool start = running.start.mode != wanted.start.mode ||
                     running.start.set_point != wanted.start.set_point ||
                     running.start.output != wanted.start.output;
  list.add_if(start, "start", "counts at the next start");
  list.add_if(running.recording.enabled != wanted.recording.enabled, "recording.enabled");
  list.add_if(running.recording.limit_bytes != wanted.recording.limit_bytes, "recording.limit_mb");
  const auto follows = [](const LoopConfig& loop) {
    return loop.normal_mode == usual_mode(loop.start.mode);
  };
  list.add_if(running.normal_mode != wanted.normal_mode && !(follows(running) && follows(wanted)),
              "alarms.normal_mode");
  list.add_if(running.monitor.overlap != wanted.monitor.overlap, "monitor.overlap");
  list.add_if(running.monitor.decimation != wanted.monitor.decimation, "monitor.decimation");
  list.add_if(running.monitor.routine != wanted.monitor.routine, "monitor.routine");
  list.add_if(running.monitor.specialists != wanted.monitor.specialists, "monitor.specialists");
  list.add_if(running.monitor.twin != wanted.monitor.twin, "monitor.twin");
  list.add_if(running.monitor.corrective != wanted.monitor.corrective, "monitor.corrective_action");
  compare_io(running, wanted, list);
}

void compare(const ModbusServer& running, const ModbusServer& wanted, List& list) {
  list.add_if(running.address != wanted.address, "modbus_server.address");
  list.add_if(running.port != wanted.port, "modbus_server.port");
  list.add_if(running.unit != wanted.unit, "modbus_server.unit");
  list.add_if(running.word_order != wanted.word_order, "modbus_server.word_order");
  list.add_if(running.most_clients != wanted.most_clients, "modbus_server.max_clients");
  list.add_if(running.idle_timeout_s != wanted.idle_timeout_s, "modbus_server.idle_timeout");
  list.add_if(running.requests_per_second != wanted.requests_per_second,
              "modbus_server.request_rate");
  list.add_if(running.writes != wanted.writes, "modbus_server.writes");
  list.add_if(running.clients != wanted.clients, "modbus_server.clients");
  list.add_if(running.master_timeout_s != wanted.master_timeout_s ||
                  running.on_master_loss != wanted.on_master_loss,
              "modbus_server.master_heartbeat");
  list.add_if(running.serial != wanted.serial, "modbus_server.serial");
}

// Taken over at once: log_level, stop_timeout, page, edge.
void compare(const DaemonConfig& running, const DaemonConfig& wanted, List& list) {
  list.add_if(running.real_time.priority != wanted.real_time.priority, "real_time.priority");
  list.add_if(running.real_time.cpu != wanted.real_time.cpu, "real_time.cpu");
  list.add_if(running.real_time.lock_memory != wanted.real_time.lock_memory,
              "real_time.lock_memory");
  list.add_if(running.accelerate != wanted.accelerate, "accelerate");
  list.add_if(running.runtime_directory != wanted.runtime_directory, "runtime_directory");
  list.add_if(running.state_directory != wanted.state_directory, "state_directory");
  if (running.modbus_server.has_value() != wanted.modbus_server.has_value()) {
    list.add("modbus_server");
  } else if (running.modbus_server) {
    compare(*running.modbus_server, *wanted.modbus_server, list);
  }
  const Alarms& was = running.alarms;
  list.add_if(was.settings.latching != wanted.alarms.settings.latching, "alarms.latching");
  list.add_if(was.settings.shelve_limit_ms != wanted.alarms.settings.shelve_limit_ms,
              "alarms.shelve_limit");
  list.add_if(was.severe_percent != wanted.alarms.severe_percent, "alarms.severe");
  list.add_if(was.most_evidence != wanted.alarms.most_evidence, "alarms.evidence");
  for (const auto& [name, link] : running.links) {
    const auto now = wanted.links.find(name);
    if (now == wanted.links.end() || now->second != link) list.add("links." + name);
  }
  for (const auto& [name, link] : wanted.links) {
    if (!running.links.contains(name)) list.add("links." + name);
  }
}

const LoopConfig* find(const Configuration& configuration, const std::string& name) {
  const auto& loops = configuration.loops;
  const auto found = std::find_if(loops.begin(), loops.end(),
                                  [&](const LoopConfig& loop) { return loop.name == name; });
  return found == loops.end() ? nullptr : &*found;
}

void append(std::vector<Waiting>& all, List& list) {
  for (Waiting& waiting : list.take()) all.push_back(std::move(waiting));
}

}  // namespace

std::string to_text(const Waiting& waiting) {
  return fmt::format("{}: {}: {}", waiting.file, waiting.key, waiting.why);
}

std::vector<Waiting> waiting_for_restart(const Configuration& running,
                                         const Configuration& wanted) {
  std::vector<Waiting> all;
  List daemon(wanted.daemon.file);
  compare(running.daemon, wanted.daemon, daemon);
  append(all, daemon);
  for (const LoopConfig& loop : wanted.loops) {
    List list(loop.file);
    if (const LoopConfig* was = find(running, loop.name)) {
      compare(*was, loop, list);
    } else {
      list.add("loop", fmt::format("loop {} is new; it needs a restart", loop.name));
    }
    append(all, list);
  }
  for (const LoopConfig& loop : running.loops) {
    if (find(wanted, loop.name) != nullptr) continue;
    List list(loop.file);
    list.add("loop",
             fmt::format("loop {} is gone from the files; it runs on until a restart", loop.name));
    append(all, list);
  }
  return all;
}

}  // namespace loopwarden::config
