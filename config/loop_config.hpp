// SPDX-License-Identifier: Apache-2.0
// The contents of the configuration files as plain data. config_reader.hpp fills it.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "hal/contract/pv_check_settings.hpp"
#include "hal/feed/feed_settings.hpp"
#include "hal/iio/analog_settings.hpp"
#include "hal/modbus/modbus_settings.hpp"
#include "hal/replay/replay_settings.hpp"
#include "hal/sim/sim_settings.hpp"
#include "base/peer_list.hpp"
#include "model/control/loop_controller.hpp"
#include "model/control/supervisor.hpp"
#include "model/alarm/alarm.hpp"
#include "model/alarm/alarm_guide.hpp"
#include "model/alarm/corrective_action.hpp"
#include "model/alarm/process_watch.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::config {

struct Start {
  control::Mode mode = control::Mode::manual;
  double set_point = 0.0;  // PV units
  // Behaviour after a restart with saved commands.
  enum class AfterRestart : std::uint8_t {
    resume,  // mode and set point of the last command
    manual,  // starts in manual
    file     // mode and set_point of the file
  };
  AfterRestart after_restart = AfterRestart::manual;
  bool output_is_told = false;  // a read-back or `output` gives the present output
  // The present output for loops without a read-back. Hold: the operator sets the first command.
  control::OutputAction output;
};

struct Recording {
  bool enabled = true;
  std::size_t limit_bytes = 64'000'000;  // size of this loop's ring of segments
};

// Division of the loop's data into windows, and the methods that evaluate them.
struct WindowCut {
  double overlap = 0.5;  // share of a window that overlaps with the next one
  // Cycles averaged into one sample. Not set: as many as fit into 0.1 s, so that a window is 96 s.
  std::optional<std::size_t> decimation;
  std::string specialists;  // their folder; empty: only the classical measures
  std::string twin;         // file of the loop's twin; empty: no model_gap
  bool routine = true;      // the routine evidence also raises alarms
  alarm::CorrectiveSettings corrective;

  friend bool operator==(const WindowCut&, const WindowCut&) = default;
};

// Source of the jacket's u_valve.
struct ValvePosition {
  enum class Source : std::uint8_t { none, read_back, model };
  Source source = Source::none;
  std::vector<effects::EffectSpec> model;  // valve effects, in order

  friend bool operator==(const ValvePosition&, const ValvePosition&) = default;
};

using SimIo = hal::sim::SimSettings;
// Replaces the wiring of a loop whose files have errors. The loop does not run, but keeps its place
// among the loops, so that the registers of other loops do not move.
struct OutOfService {
  std::string why;       // the first error
  bool watched = false;  // another controller runs the loop

  friend bool operator==(const OutOfService&, const OutOfService&) = default;
};
// ModbusSourceSettings and FeedSettings are read only.
using Io = std::variant<SimIo, hal::modbus::LoopModbusSettings, hal::iio::AnalogSettings,
                        hal::replay::ReplaySettings, hal::modbus::ModbusSourceSettings,
                        hal::feed::FeedSettings, OutOfService>;

// Returns why the loop does not run; null if its files have no error.
inline const std::string* out_of_service(const Io& io) noexcept {
  const auto* out = std::get_if<OutOfService>(&io);
  return out != nullptr ? &out->why : nullptr;
}

// Returns whether another controller runs the loop (`control: elsewhere`). Loopwarden never writes
// to such a loop.
inline bool is_watched(const Io& io) noexcept {
  const auto* out = std::get_if<OutOfService>(&io);
  return std::holds_alternative<hal::modbus::ModbusSourceSettings>(io) ||
         std::holds_alternative<hal::feed::FeedSettings>(io) || (out != nullptr && out->watched);
}
// Returns whether the set point is known. A watched loop must have a reading of the other
// controller's set point; a loop controlled here always has one.
inline bool knows_set_point(const Io& io) noexcept {
  if (const auto* modbus = std::get_if<hal::modbus::ModbusSourceSettings>(&io)) {
    return modbus->set_point.has_value();
  }
  const auto* feed = std::get_if<hal::feed::FeedSettings>(&io);
  return feed == nullptr || feed->set_point.has_value();
}

// Returns whether an enable contact is wired to the loop or is part of its simulation.
inline bool has_enable(const Io& io) noexcept {
  if (const auto* analog = std::get_if<hal::iio::AnalogSettings>(&io)) {
    return analog->enable.has_value();
  }
  const auto* sim = std::get_if<SimIo>(&io);
  return sim != nullptr &&
         std::any_of(sim->io_faults.begin(), sim->io_faults.end(),
                     [](const auto& f) { return f.kind == hal::sim::IoFault::Kind::enable_open; });
}

// Texts of an alarm from the loop's file; empty: those of alarm::guide_of.
struct AlarmTexts {
  std::string cause, consequence, action, time_to_act;

  friend bool operator==(const AlarmTexts&, const AlarmTexts&) = default;
};

struct LoopAlarmConfig {
  alarm::ProcessSettings process;
  std::array<alarm::Priority, alarm::kAlarmKindCount> priority = usual_priorities();
  std::array<AlarmTexts, alarm::kAlarmKindCount> texts;
  bool watched = false;  // another controller runs the loop

  static constexpr std::array<alarm::Priority, alarm::kAlarmKindCount> usual_priorities() {
    std::array<alarm::Priority, alarm::kAlarmKindCount> all{};
    for (const alarm::AlarmKind kind : alarm::kAlarmKinds) {
      all[alarm::index_of(kind)] = alarm::usual_priority(kind);
    }
    return all;
  }
  // Returns the texts for people.
  AlarmTexts guide(alarm::AlarmKind kind) const {
    const alarm::AlarmGuide usual = alarm::guide_of(kind, watched);
    const AlarmTexts& own = texts[alarm::index_of(kind)];
    const auto said = [](const std::string& text, const char* otherwise) {
      return text.empty() ? std::string(otherwise) : text;
    };
    return {said(own.cause, usual.cause), said(own.consequence, usual.consequence),
            said(own.action, usual.action), said(own.time_to_act, usual.time_to_act)};
  }
  friend bool operator==(const LoopAlarmConfig&, const LoopAlarmConfig&) = default;
};

struct LoopConfig {
  std::string file;
  std::uint32_t file_hash = 0;   // CRC-32 of the file's text
  std::int64_t file_time_s = 0;  // last change of the file, s since 1970
  std::string name;              // the tag, e.g. FIC-101
  std::string description;
  std::string area;    // path: Unit 2/Reactor
  std::string master;  // tag of the loop that writes the set point; empty: no cascade
  std::string pv_unit;
  std::string co_unit;
  double sample_time_s = 0.1;  // s
  hal::PvCheckSettings pv;
  control::ControllerSettings controller;
  control::SafetySettings safety;
  Start start;
  ValvePosition valve_position;
  Recording recording;
  WindowCut monitor;
  LoopAlarmConfig alarms;
  Io io;
};

struct RealTime {
  int priority = 70;       // SCHED_FIFO priority of the loop thread, 1..98; 0: ordinary
  std::optional<int> cpu;  // CPU for the loop thread
  bool lock_memory = true;
};

// The register map offered to masters: `loopwarden register-map`.
struct ModbusServer {
  enum class LossAction : std::uint8_t { report, manual, automatic };
  std::string address = "127.0.0.1";
  std::uint16_t port = 1502;
  std::uint8_t unit = 1;
  hal::modbus::ByteOrder word_order = hal::modbus::ByteOrder::abcd;
  std::size_t most_clients = 32;
  double idle_timeout_s = 60.0;
  double requests_per_second = 200.0;  // of each client
  bool writes = false;
  std::vector<base::PeerRule> clients;
  double master_timeout_s = 0.0;  // s; 0: the master's heartbeat is not watched
  LossAction on_master_loss = LossAction::report;
  // The same map on a serial line, with the daemon as RTU slave.
  struct Serial {
    hal::modbus::LinkSettings line;
    std::uint8_t unit = 1;
    bool writes = false;
    friend bool operator==(const Serial&, const Serial&) = default;
  };
  std::optional<Serial> serial;
};

struct Alarms {
  alarm::AlarmSettings settings;
  double severe_percent = 10.0;     // % of the CO span
  std::size_t most_evidence = 200;  // folders kept
};

// Recordings of all loops.
struct RecordingOfAll {
  std::optional<double> sync_s;           // s between two syncs; not set: by the kind of the disk
  std::optional<double> write_budget_mb;  // MB per day; not set: from the rows

  friend bool operator==(const RecordingOfAll&, const RecordingOfAll&) = default;
};

// A user who may write values to feed.sock. The user id of the process decides.
struct FeederUser {
  std::string user;
  std::optional<unsigned> uid;  // not set: this host has no such user, so access is denied

  friend bool operator==(const FeederUser&, const FeederUser&) = default;
};

// Commands that the peers of a socket may give. All others are refused.
struct SocketRights {
  bool alarms = false;   // acknowledge, reset, shelve; veto
  bool control = false;  // set point, mode, output, jacket
  bool tuning = false;   // gains; page.sock only
  bool reports = false;  // page.sock only: reports on recorded data
  bool tests = false;    // page.sock only: proposed tests of loops that are controlled here

  bool any() const noexcept { return alarms || control || tuning || reports || tests; }
  friend bool operator==(const SocketRights&, const SocketRights&) = default;
};

struct DaemonConfig {
  std::string file;
  RealTime real_time;
  double accelerate = 1.0;  // speed relative to real time; 1 unless all loops are simulated or
                            // replayed
  std::string runtime_directory = "/run/loopwardend";    // sockets, metrics
  std::string state_directory = "/var/lib/loopwardend";  // recordings
  std::string log_level = "info";
  double stop_timeout_s = 5.0;  // s to reach the stop actions after SIGTERM
  std::map<std::string, hal::modbus::LinkSettings> links;
  std::map<std::string, FeederUser> feeders;  // by the name that loops use
  std::optional<ModbusServer> modbus_server;
  Alarms alarms;
  RecordingOfAll recording;
  std::vector<std::string> certificates;  // PEM files whose expiry is monitored
  SocketRights page;                      // of page.sock
  SocketRights edge;                      // of edge.sock
};

struct Configuration {
  DaemonConfig daemon;
  // Controlled loops in the order of their file names, then watched loops in theirs. The place of a
  // controlled loop in the register map is thus independent of watched loops.
  std::vector<LoopConfig> loops;
  std::string text;  // loopwardend.yaml and the loop files in the order of reading
};

}  // namespace loopwarden::config
