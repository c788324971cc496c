// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/reload.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <string>
#include <vector>

#include "daemon/loops/loop_runtime.hpp"
#include "tests/config/config_support.hpp"

namespace loopwarden::tests::reload_plan_test {

using namespace loopwarden::config;
namespace test = loopwarden::config::test;
using daemon::reload::Change;
using daemon::reload::Decision;
using daemon::reload::LoopPlan;
using daemon::reload::Output;
using daemon::reload::Plan;
using test::kLoopHead;
using test::ScratchFolder;
using test::with;

namespace {

const std::string kDaemon = R"(links:
  skid: {transport: tcp, host: 127.0.0.1}
  spare: {transport: tcp, host: 127.0.0.2}
modbus_server: {port: 1502, clients: [{peer: 10.0.0.5}], serial: {device: /dev/ttyS3, unit: 4}}
alarms: {latching: false, severe: 10}
)";
std::string modbus_loop() {
  return with(test::kModbusLoop, "  output: {unit: V",
              "  jacket: {form: bounded, shadow: true, valve_position: {model: [{effect: backlash, "
              "deadband: 0.2}]}}\n  output: {unit: V") +
         "monitor: {overlap: 0.5}\n";
}
const std::string kAnalogLoop =
    test::kAnalogLoop + "  read_back: {device: adc, channel: voltage1}\n";
const std::string kReplayLoop = kLoopHead + "io: {backend: replay, record: ../r.csv}\n";
const std::string kSimLoop = kLoopHead + "io: {backend: simulated, model: ../m.yaml}\n";

// Always reads from the same folder, so that equal paths have the same meaning.
Configuration read(const std::string& daemon, const std::string& loop,
                   const std::string& model = test::kModel) {
  static const ScratchFolder folder;
  folder.write("loopwardend.yaml", daemon);
  folder.write("loops.d/a.yaml", loop);
  folder.write("m.yaml", model);
  folder.write("r.csv", "time,pv\n0,1\n0.1,1\n0.2,1\n");
  auto configuration = read_configuration(folder.path());
  INFO(to_text(configuration.diagnostics));
  REQUIRE(configuration);
  return std::move(*configuration);
}

using Keys = std::vector<std::string>;
constexpr Output kAtFive{.known = true, .value = 5.0};

Plan plan(const Configuration& running, const Configuration& wanted, Output output = kAtFive) {
  const std::vector<Output> outputs(running.loops.size(), output);
  return daemon::reload::plan(running, wanted, outputs);
}

Keys keys(const std::vector<Change>& changes) {
  Keys all;
  for (const Change& change : changes) all.push_back(change.key);
  return all;
}

// Returns the plan for the loop after one place of its file changes.
LoopPlan after(const std::string& loop, const std::string& from, const std::string& to,
               Output output = kAtFive) {
  return plan(read(kDaemon, loop), read(kDaemon, with(loop, from, to)), output).loops.at(0);
}
// Returns true if only these keys are applied.
bool applies(const LoopPlan& plan, const Keys& wanted) {
  CAPTURE(keys(plan.keys.applied), keys(plan.keys.waiting_for_restart));
  CHECK(keys(plan.keys.applied) == wanted);
  return plan.decision == Decision::apply && plan.keys.waiting_for_restart.empty() &&
         plan.waiting_for_output.empty();
}
// Returns true if these keys wait for a restart and no key is applied.
bool waits(const LoopPlan& plan, const Keys& wanted) {
  CHECK(keys(plan.keys.waiting_for_restart) == wanted);
  return plan.decision == Decision::apply && plan.keys.applied.empty();
}
// Returns true if these keys wait and the whole loop keeps its settings.
bool keeps(const LoopPlan& plan, const Keys& wanted) {
  CHECK(keys(plan.keys.waiting_for_restart) == wanted);
  return plan.decision == Decision::keep && plan.keys.applied.empty() &&
         plan.waiting_for_output.empty();
}
Keys after_daemon(const std::string& from, const std::string& to) {
  const auto all = plan(read(kDaemon, modbus_loop()), read(with(kDaemon, from, to), modbus_loop()));
  return keys(all.daemon.waiting_for_restart);
}
bool has_line(const Plan& plan, const std::string& line) {
  const std::vector<std::string> lines = daemon::reload::to_lines(plan);
  CAPTURE(lines, line);
  const bool found = std::find(lines.begin(), lines.end(), line) != lines.end();
  CHECK(found);
  return found;
}

}  // namespace

TEST_CASE("Tuning, limits, checks and safe actions are applied", "[app][reload]") {
  CHECK(applies(after(modbus_loop(), "kp: 0.35", "kp: 0.5"), {"controller.kp"}));
  CHECK(applies(after(modbus_loop(), "stop: 1", "stop: hold"), {"safe_actions.stop"}));
  CHECK(applies(after(modbus_loop(), "limits: [0, 9]", "limits: [0, 8]"),
                {"controller.set_point.limits"}));
  CHECK(applies(after(modbus_loop(), "limits: [1, 9]}", "limits: [1, 9], rate_limit: 2}"),
                {"controller.output.rate_limit"}));
  CHECK(applies(after(modbus_loop(), "range: [0, 10]}", "range: [0, 10], frozen_after: 5}"),
                {"process_variable.frozen_after"}));
  CHECK(applies(after(modbus_loop(), "form: bounded", "form: dwell"), {"controller.jacket.form"}));
  CHECK(applies(after(modbus_loop(), "form: bounded", "form: bounded, ks: 2"),
                {"controller.jacket.ks"}));
  CHECK(applies(after(kSimLoop, "  output: {unit",
                      "  compensator: {kind: backlash, gap: 0.1}\n  output: {unit"),
                {"controller.compensator"}));
  CHECK(applies(after(kSimLoop, "loop: FIC-101", "loop: FIC-101"), {}));
}

TEST_CASE("A reload applies exactly the keys that the cycle takes", "[app][reload]") {
  // Each changed field of the settings is named, so that no change is applied without a report.
  const Configuration running = read(kDaemon, kSimLoop);
  const auto named = [&](auto change) {
    Configuration wanted = running;
    change(wanted.loops[0]);
    const LoopPlan loop = plan(running, wanted).loops.at(0);
    return !loop.keys.applied.empty();
  };
  CHECK(named([](LoopConfig& l) { l.controller.pid.action = control::Action::direct; }));
  CHECK(named([](LoopConfig& l) { l.controller.pid.gains.ki = 7; }));
  CHECK(named([](LoopConfig& l) { l.controller.pid.gains.kd = 7; }));
  CHECK(named([](LoopConfig& l) { l.controller.pid.gains.derivative_filter_s = 7; }));
  CHECK(named(
      [](LoopConfig& l) { l.controller.pid.anti_windup = control::AntiWindup::integral_clamp; }));
  CHECK(named([](LoopConfig& l) { l.controller.pid.tracking_time_s = 7; }));
  CHECK(named([](LoopConfig& l) { l.controller.output.deadband = 0.7; }));
  CHECK(named([](LoopConfig& l) { l.controller.set_point.rate_up_per_s = 7; }));
  CHECK(named([](LoopConfig& l) { l.controller.set_point.rate_down_per_s = 7; }));
  CHECK(named([](LoopConfig& l) { l.controller.set_point_tracks_in_manual = false; }));
  CHECK(named([](LoopConfig& l) { l.controller.compensator.noise_band = 7; }));
  CHECK(named([](LoopConfig& l) { l.controller.jacket.shadow = true; }));
  CHECK(named([](LoopConfig& l) { l.controller.jacket.dead_zone = 7; }));
  CHECK(named([](LoopConfig& l) { l.controller.jacket.max_mean_error = 7; }));
  CHECK(named([](LoopConfig& l) { l.controller.jacket.mean_error_time_s = 7; }));
  CHECK(named([](LoopConfig& l) { l.pv.max_age_s = 7; }));
  CHECK(named([](LoopConfig& l) { l.pv.range_margin = 0.7; }));
  CHECK(named([](LoopConfig& l) { l.safety.on_enable_open = control::OutputAction::go_to(7); }));
  CHECK(named([](LoopConfig& l) { l.safety.on_not_finite = control::OutputAction::go_to(7); }));
  CHECK(named([](LoopConfig& l) { l.safety.on_late_cycle = control::OutputAction::go_to(7); }));
  CHECK(named([](LoopConfig& l) { l.safety.on_output_lost = control::OutputAction::go_to(7); }));
  CHECK(named([](LoopConfig& l) { l.safety.on_bad_pv = control::OutputAction::go_to(7); }));
  CHECK(named([](LoopConfig& l) { l.safety.bad_pv_hold_s = 7; }));
  CHECK(named([](LoopConfig& l) { l.safety.uncertain_is_good = true; }));
  CHECK(named([](LoopConfig& l) {
    l.safety.recovery = l.safety.recovery == control::Recovery::manual
                            ? control::Recovery::previous_mode
                            : control::Recovery::manual;
  }));
  CHECK(named([](LoopConfig& l) { l.safety.recovery_delay_s = 7; }));
  CHECK(named([](LoopConfig& l) { l.safety.late_cycle_periods = 7; }));
}

TEST_CASE("A change that keeps the meaning of all numbers waits by itself, and the rest is applied",
          "[app][reload]") {
  CHECK(waits(after(modbus_loop(), "loop: FIC-101", "loop: FIC-101\ndescription: feed"),
              {"description"}));
  CHECK(waits(after(modbus_loop(), "start: {mode: manual", "start: {mode: automatic"), {"start"}));
  CHECK(waits(after(modbus_loop(), "monitor:", "alarms: {normal_mode: manual}\nmonitor:"),
              {"alarms.normal_mode"}));
  CHECK(waits(after(modbus_loop(), "monitor:", "alarms: {bad_pv: {on_delay: 5}}\nmonitor:"),
              {"alarms"}));
  CHECK(waits(after(modbus_loop(), "overlap: 0.5", "overlap: 0.25"), {"monitor.overlap"}));
  CHECK(waits(after(modbus_loop(), "overlap: 0.5", "decimation: 2"), {"monitor.decimation"}));
  CHECK(waits(after(modbus_loop(), "overlap: 0.5", "specialists: s"), {"monitor.specialists"}));
  CHECK(waits(after(modbus_loop(), "monitor:", "recording: {enabled: false}\nmonitor:"),
              {"recording.enabled"}));
  CHECK(waits(after(modbus_loop(), "monitor:", "recording: {limit_mb: 10}\nmonitor:"),
              {"recording.limit_mb"}));
  const Configuration running = read(kDaemon, modbus_loop());
  const Plan both = plan(running, read(kDaemon, with(with(modbus_loop(), "kp: 0.35", "kp: 0.5"),
                                                     "overlap: 0.5", "overlap: 0.25")));
  CHECK(keys(both.loops.at(0).keys.applied) == Keys{"controller.kp"});
  CHECK(keys(both.loops.at(0).keys.waiting_for_restart) == Keys{"monitor.overlap"});
  CHECK_FALSE(both.all_in_force());
  CHECK(has_line(both, "FIC-101: applied: controller.kp 0.35 -> 0.5"));
  CHECK(has_line(both, "FIC-101: waits for a restart: monitor.overlap 0.5 -> 0.25"));
}

TEST_CASE("A change of the meaning of a number keeps the whole loop", "[app][reload]") {
  CHECK(keeps(after(modbus_loop(), "unit: L/min", "unit: m3/h"), {"process_variable.unit"}));
  CHECK(keeps(after(modbus_loop(), "unit: V", "unit: mA"), {"controller.output.unit"}));
  CHECK(keeps(after(modbus_loop(), "deadband: 0.2", "deadband: 0.3"),
              {"controller.jacket.valve_position"}));
  CHECK(keeps(after(modbus_loop(), "address: 100", "address: 101"), {"io"}));
  CHECK(keeps(after(modbus_loop(), "link: skid", "link: spare"), {"io"}));
  CHECK(keeps(after(kAnalogLoop, "voltage0", "voltage3"), {"io"}));
  CHECK(keeps(after(kReplayLoop, "r.csv", "r.csv, repeat: true"), {"io"}));
  CHECK(keeps(after(kReplayLoop, "replay, record: ../r.csv", "simulated, model: ../m.yaml"),
              {"io.backend"}));
  CHECK(
      keeps(plan(read(kDaemon, kSimLoop), read(kDaemon, kSimLoop, with(test::kModel, "1.7", "1.8")))
                .loops.at(0),
            {"io.model"}));
  // Keys of the backend that are derived from others change too. Only the written keys are named.
  CHECK(keeps(after(modbus_loop(), "sample_time: 0.1", "sample_time: 0.2"),
              {"sample_time", "process_variable.max_age"}));
  CHECK(keeps(after(kAnalogLoop, "sample_time: 0.1", "sample_time: 0.2"),
              {"sample_time", "process_variable.max_age"}));
  CHECK(keeps(after(kAnalogLoop, "unit: V, range: [0, 10]", "unit: V, range: [0, 12]"),
              {"controller.output.range"}));
  CHECK(keeps(after(modbus_loop(), "unit: V, range: [0, 10]", "unit: V, range: [0, 12]"),
              {"controller.output.range"}));
  CHECK(keeps(after(kReplayLoop, "unit: V, range: [0, 10]", "unit: V, range: [0, 12]"),
              {"controller.output.range"}));
}

TEST_CASE("A link with another value keeps the loops that use it", "[app][reload]") {
  const Plan changed =
      plan(read(kDaemon, modbus_loop()), read(with(kDaemon, "host: 127.0.0.1", "host: 127.0.0.3"),
                                              with(modbus_loop(), "kp: 0.35", "kp: 0.5")));
  CHECK(keys(changed.daemon.waiting_for_restart) == Keys{"links.skid"});
  CHECK(keeps(changed.loops.at(0), {"links.skid", "controller.kp"}));
  const Plan other =
      plan(read(kDaemon, modbus_loop()), read(with(kDaemon, "host: 127.0.0.2", "host: 127.0.0.3"),
                                              with(modbus_loop(), "kp: 0.35", "kp: 0.5")));
  CHECK(keys(other.daemon.waiting_for_restart) == Keys{"links.spare"});
  CHECK(applies(other.loops.at(0), {"controller.kp"}));
}

TEST_CASE("A loop whose file changes from V to % keeps everything, and reports why",
          "[app][reload]") {
  const std::string volts = modbus_loop();
  std::string percent = with(volts, "unit: V, range: [0, 10], limits: [1, 9]",
                             "unit: '%', range: [0, 100], limits: [10, 90]");
  percent = with(with(percent, "kp: 0.35", "kp: 3.5"), "scale: 0.001", "scale: 0.01");
  percent = with(with(percent, "stop: 1", "stop: 10"), "enable_open: 1", "enable_open: 10");
  percent = with(percent, "set_point: 5, output: 1", "set_point: 5, output: 10");
  const Configuration running = read(kDaemon, volts);
  const Plan all = plan(running, read(kDaemon, percent));
  const LoopPlan& loop = all.loops.at(0);
  CHECK(keeps(loop,
              {"controller.output.unit", "controller.output.range", "start", "io", "controller.kp",
               "controller.output.limits", "safe_actions.stop", "safe_actions.enable_open"}));
  CHECK_FALSE(all.all_in_force());
  CHECK(has_line(
      all,
      "FIC-101: all changes wait for a restart, because these change the meaning of its numbers: "
      "controller.output.unit V -> %, controller.output.range [0, 10] -> [0, 100], io; "
      "also waiting: start, controller.kp 0.35 -> 3.5, controller.output.limits [1, 9] -> "
      "[10, 90], safe_actions.stop 1 -> 10, safe_actions.enable_open 1 -> 10"));
  // After a return to the old files no key waits.
  CHECK(plan(running, read(kDaemon, volts)).all_in_force());
}

TEST_CASE("The permission to act is judged for the running backend", "[app][reload]") {
  // A record is played back. The file now has a simulated plant, on which `paper` may act.
  const std::string simulated =
      with(kSimLoop, "  output: {unit",
           "  jacket: {form: bounded, valve_position: read_back}\n  output: {unit");
  const Configuration running = read(kDaemon, kReplayLoop);
  const Configuration wanted = read(kDaemon, simulated);
  const LoopPlan loop = plan(running, wanted).loops.at(0);
  CHECK(loop.decision == Decision::keep);
  CHECK(loop.keys.applied.empty());
  const auto may_act = [&](const Configuration& backend) {
    return daemon::settings_of(wanted.loops[0], backing_of(backend.loops[0].io)).jacket_may_act;
  };
  CHECK(may_act(wanted));
  CHECK(may_act(running));
  CHECK_FALSE(may_act(read(kDaemon, modbus_loop())));
}

TEST_CASE("Limits that exclude CO wait, and with them the loop's tuning", "[app][reload]") {
  const std::string narrower =
      with(with(modbus_loop(), "limits: [1, 9]", "limits: [1, 4]"), "kp: 0.35", "kp: 0.5");
  const Configuration running = read(kDaemon, modbus_loop());
  const Configuration wanted = read(kDaemon, with(narrower, "overlap: 0.5", "overlap: 0.25"));
  Plan all = plan(running, wanted);
  LoopPlan& loop = all.loops.at(0);
  CHECK(loop.decision == Decision::wait_for_output);
  CHECK(loop.keys.applied.empty());
  CHECK(keys(loop.waiting_for_output) == Keys{"controller.kp", "controller.output.limits"});
  CHECK(keys(loop.keys.waiting_for_restart) == Keys{"monitor.overlap"});
  CHECK(has_line(all,
                 "FIC-101: waits until CO, at 5 V, is inside the new limits [1, 4] V: "
                 "controller.kp 0.35 -> 0.5, controller.output.limits [1, 9] -> [1, 4]"));
  daemon::reload::confirm(loop);
  CHECK(keys(loop.keys.applied) == Keys{"controller.kp", "controller.output.limits"});
  CHECK(loop.decision == Decision::apply);
  CHECK(loop.waiting_for_output.empty());
  CHECK_FALSE(all.all_in_force());  // the monitor's key still waits

  CHECK(plan(running, wanted, {.known = true, .value = 3.0}).loops.at(0).decision ==
        Decision::apply);
  const LoopPlan unknown = plan(running, wanted, {}).loops.at(0);
  CHECK(unknown.decision == Decision::wait_for_output);
  CHECK_THAT(unknown.waiting_for_output.at(0).why, Catch::Contains("known"));
  // Wider limits exclude no output.
  CHECK(plan(wanted, running, {}).loops.at(0).decision == Decision::apply);
}

TEST_CASE("Rights, log level and stop timeout are applied", "[app][reload]") {
  const Plan all =
      plan(read(kDaemon, modbus_loop()), read("log_level: warn\nstop_timeout: 8\npage: {alarms: "
                                              "true, control: true, reports: true}\nedge: {alarms: "
                                              "true}\n" +
                                                  kDaemon,
                                              modbus_loop()));
  CHECK(keys(all.daemon.applied) == Keys{"log_level", "stop_timeout", "page", "edge"});
  CHECK(all.all_in_force());
  CHECK(
      has_line(all, all.daemon.file +
                        ": applied: log_level info -> warn, stop_timeout 5 -> 8, page {alarms: "
                        "false, control: false} -> {alarms: true, control: true, reports: true}, "
                        "edge {alarms: false, control: false} -> {alarms: true, control: false}"));
}

TEST_CASE("Everything else of loopwardend.yaml is named by its key and waits", "[app][reload]") {
  CHECK(after_daemon("links:", "real_time: {priority: 60, cpu: 1, lock_memory: false}\nlinks:") ==
        Keys{"real_time.priority", "real_time.cpu", "real_time.lock_memory"});
  CHECK(keys(plan(read(kDaemon, kSimLoop), read("accelerate: 2\n" + kDaemon, kSimLoop))
                 .daemon.waiting_for_restart) == Keys{"accelerate"});
  CHECK(
      after_daemon("links:", "runtime_directory: /run/x\nstate_directory: /var/x\nlinks:").size() ==
      2);
  CHECK(after_daemon("port: 1502", "port: 1503") == Keys{"modbus_server.port"});
  CHECK(
      after_daemon("port: 1502",
                   "address: 0.0.0.0, unit: 2, word_order: cdab, max_clients: 3, idle_timeout: 9, "
                   "request_rate: 7, writes: true, master_heartbeat: {timeout: 5}") ==
      Keys{"modbus_server.address", "modbus_server.unit", "modbus_server.word_order",
           "modbus_server.max_clients", "modbus_server.idle_timeout", "modbus_server.request_rate",
           "modbus_server.writes", "modbus_server.master_heartbeat"});
  CHECK(after_daemon("10.0.0.5", "10.0.0.6") == Keys{"modbus_server.clients"});
  CHECK(after_daemon("unit: 4", "unit: 5") == Keys{"modbus_server.serial"});
  CHECK(after_daemon("modbus_server: {port: 1502, clients: [{peer: 10.0.0.5}], serial: {device: "
                     "/dev/ttyS3, unit: 4}}\n",
                     "") == Keys{"modbus_server"});
  CHECK(after_daemon("alarms: {latching: false, severe: 10}",
                     "alarms: {latching: true, severe: 12, shelve_limit: 4, evidence: 20}") ==
        Keys{"alarms.latching", "alarms.shelve_limit", "alarms.severe", "alarms.evidence"});
  CHECK(after_daemon("  spare: {transport: tcp, host: 127.0.0.2}\n", "") == Keys{"links.spare"});
  CHECK(after_daemon("links:", "links:\n  third: {transport: tcp, host: ::1}") ==
        Keys{"links.third"});
}

TEST_CASE("Added and removed loops are named", "[app][reload]") {
  const Configuration one = read(kDaemon, modbus_loop());
  const Configuration other = read(kDaemon, with(modbus_loop(), "FIC-101", "FIC-102"));
  const Plan all = plan(one, other);
  REQUIRE(all.loops.size() == 2);
  CHECK(all.loops[0].decision == Decision::came);
  CHECK(all.loops[1].decision == Decision::gone);
  CHECK(has_line(all, "FIC-102: the loop is new; it needs a restart"));
  CHECK(has_line(
      all, "FIC-101: the loop is no longer in the files; it runs on unchanged until a restart"));
  const loopwarden::protocol::ReloadPlan told = daemon::reload::told(all);
  CHECK(told.loops.at(0).decision == "came");
  CHECK(told.loops.at(0).waiting_for_restart.at(0).key == "loop");
}

}  // namespace loopwarden::tests::reload_plan_test
