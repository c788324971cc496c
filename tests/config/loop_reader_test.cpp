// SPDX-License-Identifier: Apache-2.0
#include "config/loop_reader.hpp"

#include <cmath>

#include "tests/config/config_support.hpp"

namespace loop_reader_test {

using namespace loopwarden;
using namespace loopwarden::config;
using control::OutputAction;
using test::kModbusLoop;
using test::said_of_loop;
using test::with;

namespace {

LoopConfig read(const std::string& text) {
  auto loop = read_loop_text("loop.yaml", text, test::daemon());
  INFO(to_text(loop.diagnostics));
  REQUIRE(loop);
  return std::move(*loop);
}

// Adds a jacket after the controller's action, line 6.
std::string with_jacket(const std::string& keys) {
  return with(kModbusLoop, "  kp: 0.35\n", "  jacket: {" + keys + "}\n  kp: 0.35\n");
}

}  // namespace

TEST_CASE("A loop file fills the loop's settings", "[config][loop]") {
  const LoopConfig loop =
      read(with(kModbusLoop, "loop: FIC-101\n", "loop: FIC-101\ndescription: Cooling water\n"));
  CHECK(loop.file == "loop.yaml");
  CHECK(loop.name == "FIC-101");
  CHECK(loop.description == "Cooling water");
  CHECK(loop.pv_unit == "L/min");
  CHECK(loop.co_unit == "V");
  CHECK(loop.sample_time_s == 0.1);
  CHECK(loop.pv.low == 0.0);
  CHECK(loop.pv.high == 10.0);
  CHECK(loop.controller.pid.action == control::Action::reverse);
  CHECK(loop.controller.pid.output_low == 0.0);
  CHECK(loop.controller.pid.output_high == 10.0);
  CHECK(loop.controller.output.low == 1.0);
  CHECK(loop.controller.output.high == 9.0);
  CHECK(loop.controller.set_point.high == 9.0);
  CHECK(loop.start.mode == control::Mode::manual);
  CHECK(loop.start.set_point == 5.0);
  CHECK(loop.safety.on_stop == OutputAction::go_to(1.0));
  CHECK(loop.safety.on_bad_pv == OutputAction::hold());
  CHECK(loop.safety.on_enable_open == OutputAction::go_to(1.0));
}

TEST_CASE("Keys that a loop file omits have their default", "[config][loop]") {
  const LoopConfig loop = read(with(kModbusLoop, ", output: 1}", "}"));
  CHECK(loop.pv.max_age_s == Approx(0.3));  // three sample times
  CHECK(loop.pv.range_margin == 0.05);
  CHECK(loop.pv.frozen_after_s == 60.0);
  CHECK_FALSE(loop.pv.frozen_acts);
  CHECK(loop.pv.max_held_s == 0.0);
  CHECK(loop.controller.pid.anti_windup == control::AntiWindup::back_calculation);
  CHECK(loop.controller.set_point_tracks_in_manual);
  CHECK(std::isinf(loop.controller.set_point.rate_up_per_s));
  CHECK(std::isinf(loop.controller.output.rate_per_s));
  CHECK(loop.controller.jacket.form == control::JacketForm::off);
  CHECK(loop.valve_position.source == ValvePosition::Source::none);
  CHECK(loop.start.output == OutputAction::hold());
  CHECK(loop.safety.on_late_cycle == OutputAction::hold());
  CHECK(loop.safety.on_not_finite == OutputAction::hold());
  CHECK(loop.safety.recovery == control::Recovery::manual);
  CHECK_FALSE(loop.safety.uncertain_is_good);
  CHECK(loop.recording.enabled);
  CHECK(loop.recording.limit_bytes == 64'000'000);
}

namespace {

// Line 10, `start`, of a loop whose io section is at 17:3 and has no read-back.
std::string with_start(const std::string& start) {
  return with(kModbusLoop, "{mode: manual, set_point: 5, output: 1}", start);
}

}  // namespace

TEST_CASE("A loop continues after a restart if it begins in automatic, unless its file forbids it",
          "[config][loop]") {
  using AfterRestart = Start::AfterRestart;
  const auto start = [](const std::string& keys) { return read(with_start(keys)).start; };
  CHECK(start("{mode: automatic, set_point: 5, output: 4}").after_restart == AfterRestart::resume);
  CHECK(start("{mode: manual, set_point: 5, output: 4}").after_restart == AfterRestart::manual);
  CHECK(start("{mode: manual, set_point: 5, after_restart: continue}").after_restart ==
        AfterRestart::resume);
  CHECK(start("{mode: automatic, set_point: 5, output: 4, after_restart: file}").after_restart ==
        AfterRestart::file);
  CHECK(start("{mode: automatic, set_point: 5, output: 4}").output_is_told);
  CHECK_FALSE(start("{mode: manual, set_point: 5}").output_is_told);
  CHECK_THAT(said_of_loop(with_start("{mode: manual, set_point: 5, after_restart: warm}")),
             Catch::Contains("start.after_restart") && Catch::Contains("continue, manual or file"));
}

TEST_CASE("Automatic needs a source of the output's position", "[config][loop]") {
  const auto refused = [](const std::string& hold) {
    return "loop.yaml:10:15: error: start.mode: automatic can't begin: output is hold" + hold +
           " and the io section (at 17:3) has no read_back, so the present output is unknown. Add "
           "a read_back, set start.output to the first CO, or start in manual\n";
  };
  CHECK(said_of_loop(with_start("{mode: automatic, set_point: 5}")) == refused(" (its default)"));
  CHECK(said_of_loop(with_start("{mode: automatic, set_point: 5, output: hold}")) == refused(""));
  CHECK(said_of_loop(with(test::kAnalogLoop, "{mode: manual, set_point: 5, output: 1}",
                          "{mode: automatic, set_point: 5}")) == refused(" (its default)"));

  SECTION("a stated value is one") {
    CHECK(said_of_loop(with_start("{mode: automatic, set_point: 5, output: 4}")).empty());
  }
  SECTION("a read-back is one") {
    CHECK(said_of_loop(with(with_start("{mode: automatic, set_point: 5, output: hold}"),
                            "    comm_loss",
                            "    read_back: {table: holding, address: 101, type: u16, scale: "
                            "0.001}\n    comm_loss"))
              .empty());
    CHECK(said_of_loop(with(test::kAnalogLoop, "{mode: manual, set_point: 5, output: 1}",
                            "{mode: automatic, set_point: 5}") +
                       "  read_back: {device: adc, channel: voltage1}\n")
              .empty());
  }
  SECTION("a replayed record has its stem") {
    const test::ScratchFolder folder;
    folder.write("loop.yaml", with(test::kLoopHead, "{mode: manual, set_point: 5, output: 1}",
                                   "{mode: automatic, set_point: 5}") +
                                  "io: {backend: replay, record: r.csv}\n");
    folder.write("r.csv", "time,pv,stem\n0,1,1\n0.1,1,1\n");
    CHECK(test::said(read_loop_file(folder.path() / "loop.yaml")).empty());
  }
}

TEST_CASE("Leaving the first output to the operator gives a note with the consequence",
          "[config][loop]") {
  CHECK(said_of_loop(with_start("{mode: manual, set_point: 5}")) ==
        "loop.yaml:10:8: note: start.output: hold (the default) without a read_back: the device is "
        "not written until an operator sets an output\n");
  CHECK(
      said_of_loop(with(with_start("{mode: manual, set_point: 5, output: hold}"),
                        "{timeout: 2, set_by: device}",
                        "{timeout: 3, register: {address: 9, type: u16, scale: 0.1}, value: 3}")) ==
      "loop.yaml:10:45: note: start.output: hold without a read_back: the device is not written "
      "until an operator sets an output; only then is its watchdog register written, "
      "before the first command\n");
  CHECK(read_loop_text("loop.yaml", with_start("{mode: manual, set_point: 5}"), test::daemon()));
}

TEST_CASE("The normal mode is automatic, or is given", "[config][loop]") {
  using alarm::NormalMode;
  CHECK(read(kModbusLoop).alarms.process.normal_mode == NormalMode::automatic);
  CHECK(read(kModbusLoop + "alarms: {}\n").alarms.process.normal_mode == NormalMode::automatic);
  CHECK(read(kModbusLoop + "alarms: {normal_mode: any}\n").alarms.process.normal_mode ==
        NormalMode::any);
  CHECK(read(kModbusLoop + "alarms: {normal_mode: auto}\n").alarms.process.normal_mode ==
        NormalMode::automatic);
  CHECK(read(kModbusLoop + "alarms: {normal_mode: manual}\n").alarms.process.normal_mode ==
        NormalMode::manual);
  CHECK_THAT(said_of_loop(kModbusLoop + "alarms: {normal_mode: hand}\n"),
             Catch::Contains("alarms.normal_mode: must be automatic, manual or any (got 'hand')"));
}

TEST_CASE("Action has no default, and neither have the safe actions", "[config][loop]") {
  CHECK(said_of_loop(with(kModbusLoop, "  action: reverse\n", "")) ==
        "loop.yaml:5:3: error: missing key 'action' in 'controller' (direct or reverse)\n");
  CHECK(
      said_of_loop(with(kModbusLoop, "  stop: 1\n  bad_pv: hold\n  output_lost: hold\n", "")) ==
      "loop.yaml:12:3: error: missing key 'stop' in 'safe_actions' (`hold` or number, CO units)\n"
      "loop.yaml:12:3: error: missing key 'bad_pv' in 'safe_actions' (`hold`, number, CO units, or "
      "{hold_for, then})\n"
      "loop.yaml:12:3: error: missing key 'output_lost' in 'safe_actions' (`hold` or number, CO "
      "units)\n");
  CHECK(said_of_loop(with(kModbusLoop, "  enable_open: 1\n", "")) ==
        "loop.yaml:12:3: error: missing key 'enable_open' in 'safe_actions' (`hold` or number, CO "
        "units)\n");
}

TEST_CASE("A bad PV may be held for a time first", "[config][loop]") {
  const LoopConfig loop = read(with(kModbusLoop, "bad_pv: hold", "bad_pv: {hold_for: 5, then: 2}"));
  CHECK(loop.safety.bad_pv_hold_s == 5.0);
  CHECK(loop.safety.on_bad_pv == OutputAction::go_to(2.0));
  CHECK(read(with(kModbusLoop, "bad_pv: hold", "bad_pv: 3")).safety.on_bad_pv ==
        OutputAction::go_to(3.0));
  CHECK(said_of_loop(with(kModbusLoop, "bad_pv: hold", "bad_pv: {hold_for: 5}")) ==
        "loop.yaml:13:11: error: missing key 'then' in 'safe_actions.bad_pv' (`hold` or number, CO "
        "units)\n");
  CHECK(said_of_loop(with(kModbusLoop, "bad_pv: hold", "bad_pv: helt")) ==
        "loop.yaml:13:11: error: safe_actions.bad_pv: must be hold or a number (got 'helt')\n");
}

TEST_CASE("Values that do not fit together name both places", "[config][loop]") {
  CHECK(said_of_loop(with(kModbusLoop, "limits: [1, 9]", "limits: [-1, 9]")) ==
        "loop.yaml:9:45: error: controller.output.limits: must lie within range [0, 10] (at 9:28) "
        "(got "
        "[-1, 9])\n");
  CHECK(
      said_of_loop(with(kModbusLoop, "limits: [0, 9]", "limits: [0, 11]")) ==
      "loop.yaml:8:23: error: controller.set_point.limits: must lie within range [0, 10] (at 3:40) "
      "(got [0, 11])\n");
  CHECK(
      said_of_loop(with(kModbusLoop, "set_point: 5", "set_point: 9.5")) ==
      "loop.yaml:10:34: error: start.set_point: must lie within the set point's limits [0, 9] (at "
      "8:23) (got 9.5)\n");
  CHECK(said_of_loop(with(kModbusLoop, "stop: 1", "stop: 0")) ==
        "loop.yaml:12:9: error: safe_actions.stop: must lie within the output's limits [1, 9] (at "
        "9:45) (got 0)\n");
  CHECK(said_of_loop(with(kModbusLoop, "range: [0, 10]}", "range: [0, 10], max_age: 0.05}")) ==
        "loop.yaml:3:58: error: process_variable.max_age: must be at least sample_time = 0.1 s (at "
        "2:14) (got 0.05)\n");
  CHECK(said_of_loop(with(kModbusLoop, "limits: [1, 9]}", "limits: [1, 9], deadband: 8}")) ==
        "loop.yaml:9:63: error: controller.output.deadband: must be less than the span of the "
        "limits, "
        "8 (at 9:45) (got 8)\n");
}

TEST_CASE("Numbers outside the working range of a loop", "[config][loop]") {
  CHECK(said_of_loop(with(kModbusLoop, "sample_time: 0.1", "sample_time: 0.0009")) ==
        "loop.yaml:2:14: error: sample_time: must be >= 0.001 and <= 3600 s (got 0.0009)\n");
  CHECK(said_of_loop(with(kModbusLoop, "sample_time: 0.1", "sample_time: 3601")) ==
        "loop.yaml:2:14: error: sample_time: must be >= 0.001 and <= 3600 s (got 3601)\n");
  CHECK(said_of_loop(with(kModbusLoop, "limits: [1, 9]}", "limits: [1, 9], rate_limit: 0}")) ==
        "loop.yaml:9:65: error: controller.output.rate_limit: must be > 0 CO units/s (got 0)\n");
}

TEST_CASE("The set point's ramp is one number or one for each way", "[config][loop]") {
  const LoopConfig both = read(with(kModbusLoop, "limits: [0, 9]", "ramp: 0.5"));
  CHECK(both.controller.set_point.rate_up_per_s == 0.5);
  CHECK(both.controller.set_point.rate_down_per_s == 0.5);
  CHECK(both.controller.set_point.high == 10.0);  // PV's range, without limits
  const LoopConfig up = read(with(kModbusLoop, "limits: [0, 9]", "ramp: {up: 0.25}"));
  CHECK(up.controller.set_point.rate_up_per_s == 0.25);
  CHECK(std::isinf(up.controller.set_point.rate_down_per_s));
  CHECK(said_of_loop(with(kModbusLoop, "limits: [0, 9]", "ramp: fast")) ==
        "loop.yaml:8:21: error: controller.set_point.ramp: must be {up, down} or a number (got "
        "'fast')\n");
}

TEST_CASE("A tag that can't name files is refused, an unusual one gives a warning",
          "[config][loop]") {
  const auto tagged = [](const std::string& tag) {
    return said_of_loop(with(kModbusLoop, "loop: FIC-101", "loop: " + tag));
  };
  for (const char* tag : {"FIC-101", "F1", "FIC101A", "TIC-12345B"}) CHECK(tagged(tag).empty());
  for (const char* tag : {"flow", "FIC-", "12-FIC", "FIC-101AB", "FICABC-1", "FIC-123456"}) {
    CHECK(tagged(tag) == "loop.yaml:1:7: warning: loop: '" + std::string(tag) +
                             "' is no tag in the manner of ISA-5.1, such as FIC-101\n");
  }
  for (const char* tag :
       {"../x", "a/b", "-x", ".x", "'a b'", "FIC-101-with-a-name-beyond-32-bytes"}) {
    CHECK(tagged(tag).find("must be 1 to 32 letters, digits") != std::string::npos);
  }
}

TEST_CASE("The jacket needs the valve's position", "[config][loop]") {
  CHECK(said_of_loop(with_jacket("form: bounded, shadow: true")) ==
        "loop.yaml:6:11: error: controller.jacket: missing key 'valve_position' (`read_back` or "
        "{model: [effects]})\n");
  CHECK(said_of_loop(with_jacket("form: bounded, shadow: true, valve_position: read_back")) ==
        "loop.yaml:6:57: error: controller.jacket.valve_position: read_back is missing: the io "
        "section (at 18:3) has no read_back; add it or state a model of the valve\n");
  const LoopConfig loop = read(with_jacket(
      "form: bounded, shadow: true, valve_position: {model: [{effect: backlash, deadband: 0.4}]}"));
  CHECK(loop.valve_position.source == ValvePosition::Source::model);
  REQUIRE(loop.valve_position.model.size() == 1);
  CHECK(loop.valve_position.model.front().name == "backlash");
  CHECK(
      said_of_loop(with_jacket("form: bounded, shadow: true, valve_position: {model: [{effect: "
                               "drift, rate: 1}]}")) ==
      "loop.yaml:6:75: error: controller.jacket.valve_position.model[0].effect: 'drift' belongs to "
      "the transmitter, not to the valve\n");
}

TEST_CASE("On hardware the jacket acts within stated bounds only", "[config][loop]") {
  const std::string model = ", valve_position: {model: [{effect: backlash, deadband: 0.4}]}";
  CHECK(
      said_of_loop(with_jacket("form: paper, max_mean_error: 1" + model)) ==
      "loop.yaml:6:18: error: controller.jacket.form: paper acts in simulate and compare only, "
      "since it can park the loop off its set point. Add shadow: true, or use bounded or dwell\n");
  CHECK(said_of_loop(with_jacket("form: paper, shadow: true" + model)).empty());
  CHECK(said_of_loop(with_jacket("form: bounded" + model)) ==
        "loop.yaml:6:11: error: controller.jacket: missing key 'max_mean_error' (number > 0, PV "
        "units; "
        "required where the jacket acts on hardware)\n");
  CHECK(said_of_loop(with_jacket("form: bounded, max_mean_error: 1" + model)).empty());
}

TEST_CASE("Compensators of the thesis act in no running loop, and run in shadow",
          "[config][loop]") {
  const std::string compensator = GENERATE("kind: knocker, amplitude: 0.2",
                                           "kind: two_move, stick_band: 0.8, max_mean_error: 0.5",
                                           "kind: reinforcement, amplitude: 0.4");
  const auto said = [&](const std::string& keys) {
    return said_of_loop(with(kModbusLoop, "  kp: 0.35\n",
                             "  compensator: {" + compensator + keys + "}\n  kp: 0.35\n"));
  };
  CHECK_THAT(said(", limit: 0.5"), Catch::Contains("controller.compensator.kind: ") &&
                                       Catch::Contains(" acts in simulate and compare only. Add "
                                                       "shadow: true, or use planned_moves"));
  CHECK(said(", shadow: true").empty());
}

TEST_CASE("Corrective action needs a jacket in shadow that is bounded, and specialists",
          "[config][loop]") {
  const std::string model = ", valve_position: {model: [{effect: stiction, s: 0.5, j: 0.2}]}";
  const std::string sound = "form: dwell, shadow: true, max_mean_error: 1" + model;
  const auto monitored = [&](const std::string& jacket, const std::string& keys) {
    return with_jacket(jacket) + "monitor: {specialists: /s, corrective_action: {" + keys + "}}\n";
  };
  const LoopConfig loop = read(monitored(sound, "allowed_mean_error: 2.5"));
  CHECK(loop.monitor.corrective.enabled);
  CHECK(loop.monitor.corrective.allowed_mean_error_percent == 2.5);
  CHECK_FALSE(read(monitored(sound, "enabled: false")).monitor.corrective.enabled);
  CHECK_FALSE(read(with_jacket(sound)).monitor.corrective.enabled);
  for (const char* jacket : {"form: dwell, max_mean_error: 1", "form: paper, shadow: true"}) {
    CHECK(said_of_loop(monitored(jacket + model, "")).find("form bounded or dwell and shadow") !=
          std::string::npos);
  }
  CHECK(said_of_loop(monitored("form: dwell, shadow: true" + model, "")).find("max_mean_error") !=
        std::string::npos);
  CHECK(said_of_loop(with_jacket(sound) + "monitor: {corrective_action: {}}\n")
            .find("needs specialists") != std::string::npos);
}

TEST_CASE("Planned moves as corrective action need a twin, a read-back and, on hardware, bounds",
          "[config][loop]") {
  const std::string wired =
      with(kModbusLoop, "    command:",
           "    read_back: {table: holding, address: 101, type: u16, scale: 0.001}\n    command:");
  const auto file = [&](const std::string& keys,
                        const std::string& monitor = "twin: /twin.yaml, ") {
    return wired + "monitor: {" + monitor + "corrective_action: {form: planned_moves" + keys +
           "}}\n";
  };
  const std::string bounds = ", max_move: 1.5, max_moves_per_hour: 40";
  const alarm::CorrectiveSettings read_in =
      read(file(bounds + ", on_order: true")).monitor.corrective;
  CHECK(read_in.form == alarm::CorrectiveForm::planned_moves);
  CHECK(read_in.on_order);
  CHECK(read_in.max_move == 1.5);
  CHECK(read_in.max_moves_per_hour == 40.0);
  CHECK_THAT(said_of_loop(file(", max_move: 1.5")),
             Catch::Contains("missing key 'max_moves_per_hour'"));
  CHECK_THAT(said_of_loop(kModbusLoop +
                          "monitor: {twin: /twin.yaml, corrective_action: {form: "
                          "planned_moves" +
                          bounds + "}}\n"),
             Catch::Contains("needs a read_back"));
  CHECK_THAT(said_of_loop(file(bounds, "specialists: /s, ")), Catch::Contains("monitor.twin"));
  CHECK_THAT(said_of_loop(file(bounds + ", allowed_mean_error: 1")),
             Catch::Contains("applies only to form jacket"));
  CHECK_THAT(said_of_loop(with(file(bounds), "  kp: 0.35\n",
                               "  compensator: {kind: backlash, gap: 0.3, limit: 0.3}\n  kp: "
                               "0.35\n")),
             Catch::Contains("replaces controller.compensator"));
  // A jacket in shadow stays in shadow.
  const std::string jacket =
      "  jacket: {form: dwell, shadow: true, valve_position: {model: [{effect: backlash, deadband: "
      "0.4}]}}\n  kp: 0.35\n";
  CHECK(said_of_loop(with(file(bounds), "  kp: 0.35\n", jacket)).empty());
  CHECK_THAT(
      said_of_loop(kModbusLoop + "monitor: {specialists: /s, corrective_action: {max_move: 1}}\n"),
      Catch::Contains("applies only to form planned_moves"));
}

TEST_CASE("On hardware a compensator needs a limit, and does not act together with the jacket",
          "[config][loop]") {
  const auto said = [](const std::string& compensator, const std::string& jacket = "") {
    return said_of_loop(with(kModbusLoop, "  kp: 0.35\n",
                             jacket + "  compensator: {" + compensator + "}\n  kp: 0.35\n"));
  };
  CHECK(said("kind: backlash, gap: 0.3") ==
        "loop.yaml:6:16: error: controller.compensator: missing key 'limit' (required where "
        "backlash acts on hardware)\n");
  CHECK(said("kind: backlash, gap: 0.3, limit: 0.3").empty());
  const std::string moves =
      "kind: planned_moves, process: {gain: 1, time_constant: 2, dead_time: 1}, load: 0, s: 0.6, "
      "j: 0.3, ";
  CHECK_THAT(said(moves + "s_interval: [0.5, 0.8]"), Catch::Contains("missing key 'max_move'"));
  const std::string limits = "max_move: 1, max_moves_per_hour: 30, ";
  CHECK_THAT(said(moves + limits), Catch::Contains("missing key 's_interval'"));
  CHECK_THAT(said(moves + limits + "s_interval: [0.3, 0.8]"), Catch::Contains("factor of two"));
  CHECK_THAT(said(moves + limits + "s_interval: [0.5, 0.8], read_back: false"),
             Catch::Contains("only with a read-back"));
  CHECK(said(moves + "shadow: true, read_back: false").empty());
  // With the other sign, in shadow as well; kModbusLoop has action reverse.
  std::string other_sign = moves + "shadow: true, read_back: false";
  other_sign.replace(other_sign.find("gain: 1"), 7, "gain: -1");
  CHECK_THAT(said(other_sign), Catch::Contains("gain -1 contradicts controller.action reverse"));
  CHECK(said("kind: backlash, gap: 0.3, shadow: true").empty());
  const std::string jacket =
      "  jacket: {form: dwell, max_mean_error: 1, valve_position: {model: [{effect: backlash, "
      "deadband: 0.4}]}}\n";
  CHECK_THAT(said("kind: backlash, gap: 0.3, limit: 0.3", jacket),
             Catch::Contains("backlash can't act together with the jacket"));
  CHECK(said("kind: backlash, gap: 0.3, shadow: true", jacket).empty());
  // A jacket in shadow also acts if corrective action switches it on.
  const std::string in_shadow =
      "  jacket: {form: dwell, shadow: true, max_mean_error: 1, valve_position: {model: [{effect: "
      "backlash, deadband: 0.4}]}}\n";
  CHECK(said("kind: backlash, gap: 0.3, limit: 0.3", in_shadow).empty());
  const std::string file =
      with(kModbusLoop, "  kp: 0.35\n",
           in_shadow + "  compensator: {kind: backlash, gap: 0.3, limit: 0.3}\n  kp: 0.35\n");
  CHECK_THAT(
      said_of_loop(file + "monitor: {specialists: /s, corrective_action: {}}\n"),
      Catch::Contains("can't act together with the jacket, which corrective_action switches on"));
}

TEST_CASE("CO that deadband and converter hold back is no windup", "[config][loop]") {
  // The register's own step is 0.001 V.
  CHECK(read(kModbusLoop).controller.pid.tolerance == Approx(0.001));
  CHECK(read(with(kModbusLoop, "limits: [1, 9]}", "limits: [1, 9], deadband: 0.2}"))
            .controller.pid.tolerance == Approx(0.201));
}

TEST_CASE("A derivative without a filter gives a warning", "[config][loop]") {
  CHECK(said_of_loop(with(kModbusLoop, "  ki: 0.04\n", "  ki: 0.04\n  kd: 0.1\n")) ==
        "loop.yaml:8:7: warning: controller.kd: derivative without derivative_filter: noise of PV "
        "passes unfiltered to the valve\n");
  CHECK(said_of_loop(
            with(kModbusLoop, "  ki: 0.04\n", "  ki: 0.04\n  kd: 0.1\n  derivative_filter: 0.5\n"))
            .empty());
}

}  // namespace loop_reader_test
