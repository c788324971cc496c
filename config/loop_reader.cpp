// SPDX-License-Identifier: Apache-2.0
#include "config/loop_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <tuple>
#include <variant>

#include "config/alarms_reader.hpp"
#include "config/character.hpp"
#include "config/controller_reader.hpp"
#include "config/corrective_reader.hpp"
#include "config/effect_reader.hpp"
#include "config/interlocks.hpp"
#include "config/io_reader.hpp"
#include "config/source_file.hpp"
#include "config/watched_io_reader.hpp"
#include "model/alarm/box_alarms.hpp"

namespace loopwarden::config {
namespace {

using control::Mode;
using control::OutputAction;
using control::Recovery;
using RangeValue = Value<std::pair<double, double>>;

constexpr auto kStartModes =
    std::to_array<Choice<Mode>>({{"manual", Mode::manual}, {"automatic", Mode::automatic}});
constexpr auto kAfterRestart =
    std::to_array<Choice<Start::AfterRestart>>({{"continue", Start::AfterRestart::resume},
                                                {"manual", Start::AfterRestart::manual},
                                                {"file", Start::AfterRestart::file}});
constexpr auto kRecoveries = std::to_array<Choice<Recovery>>(
    {{"manual", Recovery::manual}, {"previous_mode", Recovery::previous_mode}});
constexpr auto kUncertain = std::to_array<Choice<bool>>({{"bad", false}, {"good", true}});
constexpr auto kControls = std::to_array<Choice<bool>>({{"here", false}, {"elsewhere", true}});
constexpr const char* kControlMeaning =
    "controller of the loop; elsewhere: another controller, and Loopwarden never writes to the "
    "loop";
constexpr const char* kAlarmsMeaning = "alarms of this loop: limits, delays, priorities, texts";
constexpr auto kReadBack = std::to_array<Choice<bool>>({{"read_back", true}});

bool is_letter(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }

// Checks a tag of ISA-5.1: one to five capitals, a number of one to five digits, an optional
// suffix: FIC-101A.
bool is_isa_tag(std::string_view tag) {
  const auto count = [&](auto is_wanted) {
    const auto end = std::find_if_not(tag.begin(), tag.end(), is_wanted);
    const auto length = static_cast<std::size_t>(end - tag.begin());
    tag.remove_prefix(length);
    return length;
  };
  const auto is_capital = [](char c) { return c >= 'A' && c <= 'Z'; };
  const std::size_t letters = count(is_capital);
  if (tag.starts_with('-')) tag.remove_prefix(1);
  const std::size_t digits = count(is_digit);
  const std::size_t suffix = count(is_capital);
  return letters >= 1 && letters <= 5 && digits >= 1 && digits <= 5 && suffix <= 1 && tag.empty();
}

std::string within_text(const RangeValue& range) {
  return fmt::format("[{}, {}] (at {})", brief(range.value.first), brief(range.value.second),
                     to_text(range.place));
}

void require_within(MapReader& in, const Value<double>& value, const RangeValue& range,
                    const char* range_name) {
  if (!value.given || !value.valid || !range.valid) return;
  if (value >= range.value.first && value <= range.value.second) return;
  in.report().error(
      value.place, value.key,
      fmt::format("must lie within {} {} (got {})", range_name, within_text(range), brief(value)));
}

class LoopReader {
 public:
  LoopReader(MapReader& in, const std::string& file, const DaemonConfig& daemon)
      : in_(in), daemon_(daemon) {
    loop_.config.file = file;
  }

  LoopFile read() {
    read_head();
    std::optional<MapReader> controller = in_.need_section("controller", "the law and its limits");
    in_.need_section("process_variable", "PV and its checks",
                     [&](MapReader& pv) { read_process_variable(pv); });
    std::optional<MapReader> jacket;
    if (controller) jacket = read_controller(*controller);
    std::optional<MapReader> start = in_.need_section("start", "start of the loop");
    if (start) read_start(*start);
    in_.need_section("safe_actions", "output for each kind of fault: `hold`, or the CO to move to",
                     [&](MapReader& actions) { read_safe_actions(actions); });
    in_.maybe_section("recording", "of the loop to disk",
                      [&](MapReader& recording) { read_recording(recording); });
    in_.maybe_section("monitor", "windows of 961 samples, and the specialists that evaluate them",
                      [&](MapReader& monitor) { read_monitor(monitor); });
    std::optional<MapReader> alarms = in_.maybe_section("alarms", kAlarmsMeaning);
    IoSection io;
    if (std::optional<MapReader> section = in_.need_section("io", "what the loop is wired to")) {
      io = read_io(*section, io_context());
    }
    loop_.command = io.command;
    loop_.record = io.record;
    loop_.hardware = backing_of(io.io).hardware;
    loop_.output_known = io.output_known && stop_known_ && output_limits_.valid;
    if (start) check_start(*start, io);
    if (jacket) check_jacket(*jacket, io);
    if (compensator_) check_compensator(*compensator_, io);
    if (corrective_) check_corrective_io(*corrective_, config().monitor.corrective, io);
    // Output that the converter and the deadband withhold does not count as windup.
    config().controller.pid.tolerance = config().controller.output.deadband + io.output_resolution;
    config().io = std::move(io.io);
    read_alarms(std::move(alarms));
    return std::move(loop_);
  }

  LoopFile read_watched() {
    watched_ = true;
    loop_.watched = true;
    read_head();
    in_.need_section("process_variable", "PV and its checks",
                     [&](MapReader& pv) { read_process_variable(pv); });
    in_.need_section("output", "CO of the other controller",
                     [&](MapReader& output) { read_watched_output(output); });
    in_.maybe_section("controller", "settings of the other controller; for people",
                      [&](MapReader& controller) { read_watched_law(controller); });
    in_.maybe_section("recording", "of the loop to disk",
                      [&](MapReader& recording) { read_recording(recording); });
    in_.maybe_section("monitor", "windows of 961 samples, and the specialists that evaluate them",
                      [&](MapReader& monitor) { read_monitor(monitor); });
    std::optional<MapReader> alarms = in_.maybe_section("alarms", kAlarmsMeaning);
    refuse(in_, {"start", "safe_actions"});
    if (std::optional<MapReader> section = in_.need_section("io", "source of its values")) {
      IoSection io = read_watched_io(*section, io_context());
      loop_.command = io.command;
      config().io = std::move(io.io);
      if (auto* feed = std::get_if<hal::feed::FeedSettings>(&config().io))
        accept_cascade(feed->mode_values);
    }
    read_alarms(std::move(alarms));
    loop_.hardware = true;
    return std::move(loop_);
  }

 private:
  IoContext io_context() {
    return {.file = config().file,
            .sample_time = sample_time_,
            .max_age = max_age_,
            .pv_range = pv_range_,
            .output_range = output_range_,
            .links = &daemon_.links,
            .feeders = &daemon_.feeders,
            .link_uses = &loop_.link_uses};
  }

  // Refuses keys that would act on a loop that is only watched.
  void refuse(MapReader& in, std::initializer_list<std::string_view> keys) {
    for (const std::string_view key : keys) {
      if (in.describing() || !in.given(key)) continue;
      in.declare(key, "", Presence::optional, "", "");
      in.error(key, fmt::format("is refused: Loopwarden never writes to this loop, because another "
                                "controller runs it (control: elsewhere, at {})",
                                to_text(in_.place("control"))));
    }
  }

  void read_watched_output(MapReader& in) {
    control::ControllerSettings& controller = config().controller;
    config().co_unit = in.need_text("unit", "of CO, such as %");
    output_range_ = in.need_range("range", {"CO units", any_number(), "of the controller output"});
    std::tie(controller.pid.output_low, controller.pid.output_high) = output_range_.value;
    std::tie(controller.output.low, controller.output.high) = output_range_.value;
    std::tie(controller.set_point.low, controller.set_point.high) = pv_range_.value;
    refuse(in, {"limits", "rate_limit", "deadband"});
  }

  void read_watched_law(MapReader& in) {
    control::PidSettings& pid = config().controller.pid;
    pid.action = in.need_one_of("action", kActions, "reverse: PV up, output down");
    pid.gains = read_gains(in, span(pv_range_), span(output_range_));
    refuse(in, {"jacket", "compensator", "output", "set_point", "set_point_tracks_in_manual",
                "anti_windup", "tracking_time"});
  }

  const LoopConfig& config() const noexcept { return loop_.config; }
  LoopConfig& config() noexcept { return loop_.config; }

  void read_head() {
    const Value<std::string> tag = in_.need_text("loop", "the loop's tag, such as FIC-101");
    loop_.tag = tag.place;
    config().name = tag;
    if (tag.given && tag.valid) {
      if (!is_usable_tag(tag.value)) {
        in_.error("loop", fmt::format("must be 1 to 32 letters, digits, '-', '_' or '.', beginning "
                                      "with a letter or digit (got '{}')",
                                      quotable(tag.value)));
      } else if (tag.value == alarm::kBox) {
        in_.error("loop",
                  "'box' is reserved: it names the box itself in alarms. Choose another tag");
      } else if (!is_isa_tag(tag.value)) {
        in_.warning("loop", fmt::format("'{}' is no tag in the manner of ISA-5.1, such as FIC-101",
                                        tag.value));
      }
    }
    const Value<std::string> description = in_.text("description", "for people", "none");
    if (description.given) config().description = description;
    read_area();
    read_cascade();
    sample_time_ = read_sample_time(in_);
    if (sample_time_.valid) config().sample_time_s = sample_time_;
  }

  void read_area() {
    const Value<std::string> area =
        in_.text("area", "area of the plant as a path, such as Unit 2/Reactor", "none");
    if (!area.given || !area.valid) return;
    const std::string& path = area.value;
    if (path.starts_with('/') || path.ends_with('/') || path.find("//") != path.npos) {
      in_.error("area", fmt::format("must be names separated by single slashes, such as Unit "
                                    "2/Reactor (got '{}')",
                                    quotable(path)));
    }
    config().area = path;
  }

  void read_cascade() {
    in_.maybe_section("cascade", "for the slave of a cascade", [&](MapReader& cascade) {
      const Value<std::string> master =
          cascade.need_text("master", "tag of the loop that writes the set point");
      loop_.master = master.place;
      config().master = master;
      if (!config().name.empty() && config().master == config().name)
        cascade.error("master", "must be another loop than this one");
    });
  }

  // A slave in cascade is in its normal mode: its master writes the set point.
  void accept_cascade(hal::ModeValues& modes) const {
    if (config().master.empty()) return;
    for (const char* word :
         {"CAS", "Cas", "cas", "CASCADE", "Cascade", "cascade", "RCAS", "RCas", "KAS", "RSP"}) {
      const double value = hal::number_of_word(word);
      if (!hal::holds(modes.manual, value) && !hal::holds(modes.automatic, value))
        modes.automatic.push_back(value);
    }
  }

  void read_process_variable(MapReader& in) {
    hal::PvCheckSettings& pv = config().pv;
    config().pv_unit = in.need_text("unit", "of PV and SP, such as L/min");
    pv_range_ = in.need_range("range", {"PV units", any_number(), "of the transmitter"});
    std::tie(pv.low, pv.high) = pv_range_.value;
    max_age_ = in.number("max_age", {"s", above(0.0), "older is bad", "three sample times"},
                         3.0 * config().sample_time_s);
    pv.max_age_s = max_age_;
    in.set_number("range_margin",
                  {"", between(0.0, 1.0),
                   "share of the span that PV, SP, CO and stem may lie outside their range; CO and "
                   "stem at least 0.05"},
                  pv.range_margin);
    const Value<double> frozen_after =
        in.maybe_number("frozen_after", {"s", at_least(0.0),
                                         "time in which PV must change after CO has moved by 10 % "
                                         "of its span, otherwise PV is frozen; 0: not checked",
                                         "60 s or 30 sample times, whichever is longer"});
    pv.frozen_acts = !watched_ && frozen_after.given;
    pv.frozen_after_s =
        frozen_after.given ? frozen_after.value : hal::usual_frozen_after_s(config().sample_time_s);
    pv.max_held_s = in.number("max_held",
                              {"s", at_least(0.0),
                               "longest time without a new sample for a value of a live feeder; "
                               "older is bad; 0: held without limit"},
                              0.0);
    if (max_age_.given && max_age_.valid && sample_time_.valid && max_age_ < sample_time_) {
      in.error("max_age",
               fmt::format("must be at least sample_time = {} s (at {}) (got {})",
                           brief(sample_time_), to_text(sample_time_.place), brief(max_age_)));
      max_age_.valid = false;
    }
  }

  // Returns the jacket's section, for later checks that depend on the backend.
  std::optional<MapReader> read_controller(MapReader& in) {
    control::ControllerSettings& controller = config().controller;
    controller.pid.action = in.need_one_of("action", kActions, "reverse: PV up, output down");
    in.need_section("output", "CO and its limits", [&](MapReader& output) { read_output(output); });
    controller.pid.gains = read_gains(in, span(pv_range_), span(output_range_));
    if (controller.pid.gains.kd > 0.0 && controller.pid.gains.derivative_filter_s <= 0.0) {
      in.warning(
          in.given("kd") ? "kd" : "td",
          "derivative without derivative_filter: noise of PV passes unfiltered to the valve");
    }
    read_anti_windup(in, control::AntiWindup::back_calculation, controller.pid);
    sp_limits_ = pv_range_;
    in.maybe_section("set_point", "limits and ramp of SP",
                     [&](MapReader& set_point) { read_set_point(set_point); });
    std::tie(controller.set_point.low, controller.set_point.high) = sp_limits_.value;
    controller.set_point_tracks_in_manual =
        in.flag("set_point_tracks_in_manual", "SP follows PV while in manual", true);
    compensator_ = in.maybe_section("compensator", "correction of CO against the valve's fault");
    if (compensator_) controller.compensator = read_compensator(*compensator_);
    std::optional<MapReader> jacket = in.maybe_section("jacket", "the stickband jacket");
    if (jacket) {
      controller.jacket = read_jacket(*jacket);
      read_valve_position(*jacket);
    }
    return jacket;
  }

  static std::optional<double> span(const RangeValue& range) {
    if (!range.given || !range.valid) return std::nullopt;
    return range.value.second - range.value.first;
  }

  // Returns a narrower range inside `outer`; `outer` itself if the key is absent.
  RangeValue read_limits(MapReader& in, const char* unit, const RangeValue& outer,
                         const char* fallback, const char* meaning) {
    RangeValue limits = in.maybe_range("limits", {unit, any_number(), meaning, fallback});
    if (!limits.given) return outer;
    if (limits.valid && outer.valid &&
        (limits.value.first < outer.value.first || limits.value.second > outer.value.second)) {
      in.error("limits", fmt::format("must lie within range {} (got [{}, {}])", within_text(outer),
                                     brief(limits.value.first), brief(limits.value.second)));
      limits.valid = false;
    }
    return limits;
  }

  void read_output(MapReader& in) {
    control::ControllerSettings& controller = config().controller;
    config().co_unit = in.need_text("unit", "of CO, such as V or %");
    output_range_ = in.need_range("range", {"CO units", any_number(), "of the controller output"});
    output_limits_ = read_limits(in, "CO units", output_range_, "range", "permitted output");
    const Value<double> rate = in.maybe_number(
        "rate_limit", {"CO units/s", above(0.0), "fastest change of the output", "none"});
    const Value<double> deadband =
        in.number("deadband", {"CO units", at_least(0.0), "smaller changes are not output"}, 0.0);
    std::tie(controller.pid.output_low, controller.pid.output_high) = output_range_.value;
    std::tie(controller.output.low, controller.output.high) = output_limits_.value;
    if (rate.given) controller.output.rate_per_s = rate;
    controller.output.deadband = deadband;
    const double limits_span = output_limits_.value.second - output_limits_.value.first;
    if (deadband.valid && output_limits_.valid && deadband > 0.0 && deadband >= limits_span) {
      in.error("deadband",
               fmt::format("must be less than the span of the limits, {} (at {}) (got {})",
                           brief(limits_span), to_text(output_limits_.place), brief(deadband)));
    }
  }

  void read_set_point(MapReader& in) {
    control::SetPointLimits& set_point = config().controller.set_point;
    sp_limits_ =
        read_limits(in, "PV units", pv_range_, "process_variable.range", "permitted set points");
    constexpr const char* kMeaning = "fastest change of the working set point";
    in.declare("ramp", "number > 0, PV units/s, or {up, down}", Presence::optional, "none",
               kMeaning);
    if (!in.given("ramp") && !in.describing()) return;
    if (in.describing() || in.kind("ramp") == YamlNode::Kind::map) {
      std::optional<MapReader> ramp = in.maybe_section("ramp", kMeaning);
      const Value<double> up =
          ramp->maybe_number("up", {"PV units/s", above(0.0), kMeaning, "none"});
      const Value<double> down =
          ramp->maybe_number("down", {"PV units/s", above(0.0), kMeaning, "none"});
      if (up.given) set_point.rate_up_per_s = up;
      if (down.given) set_point.rate_down_per_s = down;
    } else {
      const Value<double> ramp = in.maybe_number(
          "ramp", {.unit = "PV units/s", .range = above(0.0), .words = "{up, down} or "});
      set_point.rate_up_per_s = ramp;
      set_point.rate_down_per_s = ramp;
    }
  }

  void read_valve_position(MapReader& in) {
    constexpr const char* kKey = "valve_position";
    constexpr const char* kMeaning = "source of the valve's position for the jacket";
    ValvePosition& position = config().valve_position;
    in.declare(kKey, "`read_back` or {model: [effects]}", Presence::optional,
               "required unless form is off", kMeaning);
    if (!in.given(kKey) && !in.describing()) return;
    if (!in.describing() && in.kind(kKey) != YamlNode::Kind::map) {
      in.need_one_of(kKey, kReadBack, kMeaning);
      position.source = ValvePosition::Source::read_back;
      return;
    }
    std::optional<MapReader> section = in.maybe_section(kKey, kMeaning);
    position.source = ValvePosition::Source::model;
    const effects::EffectContext context{.sample_time_s = config().sample_time_s,
                                         .output_low = output_range_.value.first,
                                         .output_high = output_range_.value.second};
    position.model = read_effects(*section, "model", effects::Block::valve, context,
                                  "in the order CO meets them");
    if (!section->given("model")) section->error("missing key 'model' (list of valve effects)");
  }

  // Reads `hold` or a value within the output's limits.
  OutputAction read_action(MapReader& in, std::string_view key, Presence presence,
                           const char* meaning) {
    if (!in.declare(key, "`hold` or number, CO units", presence, "hold", meaning)) return {};
    if (in.word(key) == "hold") return OutputAction::hold();
    const Value<double> value = in.maybe_number(key, {.unit = "CO units", .words = "hold or "});
    require_within(in, value, output_limits_, "the output's limits");
    return OutputAction::go_to(value);
  }

  void read_start(MapReader& in) {
    Start& start = config().start;
    start.mode = in.need_one_of("mode", kStartModes, "at the start of the loop");
    const Value<double> set_point =
        in.need_number("set_point", {"PV units", any_number(), "to begin with"});
    start.set_point = set_point;
    require_within(in, set_point, sp_limits_, "the set point's limits");
    read_after_restart(in);
    start.output = read_action(in, "output", Presence::optional,
                               "the first CO if there is no read-back; `hold`: neither CO nor a "
                               "watchdog register is written until an operator sets an output");
  }

  void read_after_restart(MapReader& in) {
    constexpr const char* kKey = "after_restart";
    constexpr const char* kMeaning =
        "after a restart of the daemon: continue with the mode and set point of the last command, "
        "in manual, or with mode and set_point of this file";
    Start& start = config().start;
    start.after_restart =
        start.mode == Mode::automatic ? Start::AfterRestart::resume : Start::AfterRestart::manual;
    if (!in.given(kKey)) {
      in.declare(kKey, "continue, manual or file", Presence::optional,
                 "continue where `mode` is automatic, otherwise manual", kMeaning);
      return;
    }
    start.after_restart = in.need_one_of(kKey, kAfterRestart, kMeaning);
  }

  void read_safe_actions(MapReader& in) {
    control::SafetySettings& safety = config().safety;
    const auto need = [&](const char* key, const char* meaning) {
      return read_action(in, key, Presence::required, meaning);
    };
    const std::size_t errors = in.report().error_count();
    safety.on_stop = need("stop", "the daemon ends (SIGTERM), or `loopwardend --safe` runs");
    stop_known_ = in.report().error_count() == errors;
    read_bad_pv(in);
    safety.on_output_lost = need("output_lost", "commands do not reach the positioner");
    safety.on_enable_open =
        need("enable_open", "the enable contact is open; not a safety function");
    safety.on_late_cycle = read_action(in, "late_cycle", Presence::optional,
                                       "a cycle started more than late_cycle_periods late");
    safety.on_not_finite = read_action(in, "not_finite", Presence::optional,
                                       "the controller's result is NaN or infinity");
    safety.uncertain_is_good =
        in.one_of("uncertain_pv", kUncertain, "treatment of a PV of uncertain quality", false);
    safety.late_cycle_periods = static_cast<std::uint32_t>(
        in.integer("late_cycle_periods", {1, 1000, "", "see late_cycle"}, 3));
    safety.recovery =
        in.one_of("recovery", kRecoveries, "mode after the fault has cleared", Recovery::manual);
    in.set_number("recovery_delay",
                  {"s", at_least(0.0), "time without a fault before the loop resumes"},
                  safety.recovery_delay_s);
  }

  void read_bad_pv(MapReader& in) {
    constexpr const char* kMeaning = "PV is bad; with hold_for the output is held first";
    control::SafetySettings& safety = config().safety;
    const bool present = in.declare("bad_pv", "`hold`, number, CO units, or {hold_for, then}",
                                    Presence::required, "", kMeaning);
    if (!present && !in.describing()) return;
    if (!in.describing() && in.kind("bad_pv") != YamlNode::Kind::map) {
      safety.on_bad_pv = read_action(in, "bad_pv", Presence::required, kMeaning);
      return;
    }
    std::optional<MapReader> section = in.maybe_section("bad_pv", kMeaning);
    safety.bad_pv_hold_s = section->need_number("hold_for", {"s", at_least(0.0), "before `then`"});
    safety.on_bad_pv = read_action(*section, "then", Presence::required, "after that");
  }

  void read_recording(MapReader& in) {
    constexpr std::int64_t kMegabyte = 1'000'000;
    Recording& recording = config().recording;
    in.set_flag("enabled", "record every cycle", recording.enabled);
    const Value<std::int64_t> limit =
        in.integer("limit_mb", {1, 1'000'000, "MB", "the oldest is deleted first"}, 64);
    recording.limit_bytes = static_cast<std::size_t>(limit.value * kMegabyte);
  }

  void read_monitor(MapReader& in) {
    WindowCut& monitor = config().monitor;
    in.set_number("overlap",
                  {"", between(0.0, 0.95), "share of a window that overlaps with the next one"},
                  monitor.overlap);
    const Value<std::int64_t> decimation =
        in.maybe_integer("decimation", {1, 10'000, "", "cycles averaged into one sample", false,
                                        "as many as fit into 0.1 s, so that a window is 96 s"});
    if (decimation.given) monitor.decimation = static_cast<std::size_t>(decimation.value);
    in.set_flag(
        "routine",
        "also raise alarms from routine evidence of minutes and hours; needs no specialists",
        monitor.routine);
    const Value<std::string> specialists =
        in.text("specialists",
                "folder made by `loopwarden train`; without it only classical measures and routine "
                "evidence are used",
                "");
    loop_.specialists = specialists.place;
    if (specialists.given && specialists.valid) {
      monitor.specialists = resolve(config().file, specialists.value);
    }
    const Value<std::string> twin =
        in.text("twin",
                "file twin.yaml from `loopwarden commission`; the alarm model_gap is raised if the "
                "loop no longer behaves like it",
                "");
    loop_.twin = twin.place;
    if (twin.given && twin.valid) monitor.twin = resolve(config().file, twin.value);
    if (watched_) return refuse(in, {"corrective_action"});
    corrective_ = in.maybe_section("corrective_action",
                                   "the jacket or planned moves act while the valve is known to "
                                   "stick, and end if they do not help");
    if (corrective_) read_corrective_action(*corrective_, config().controller, monitor);
  }

  // Called after io, because the available alarms depend on the wiring.
  void read_alarms(std::optional<MapReader> in) {
    config().alarms =
        read_loop_alarms(std::move(in), {.pv_range = pv_range_,
                                         .watched = watched_,
                                         .knows_set_point = knows_set_point(config().io),
                                         .has_enable = has_enable(config().io)});
  }

  // Checks that the present output is known. Without a read-back it needs a stated value or an
  // operator.
  void check_start(MapReader& in, const IoSection& io) {
    config().start.output_is_told =
        io.has_read_back || config().start.output.kind != OutputAction::Kind::hold;
    if (!io.known || io.has_read_back || in.describing()) return;
    if (config().start.output.kind != OutputAction::Kind::hold) return;
    if (config().start.mode == Mode::automatic) {
      in.error("mode",
               fmt::format("automatic can't begin: output is hold{} and the io section (at {}) has "
                           "no read_back, so the present output is unknown. Add a read_back, set "
                           "start.output to the first CO, or start in manual",
                           in.given("output") ? "" : " (its default)", to_text(in_.place("io"))));
      return;
    }
    const auto* modbus = std::get_if<hal::modbus::LoopModbusSettings>(&io.io);
    const bool arms = modbus != nullptr && modbus->comm_loss.watchdog.has_value();
    in.note(
        "output",
        fmt::format(
            "hold{} without a read_back: the device is not written until an operator sets an "
            "output{}",
            in.given("output") ? "" : " (the default)",
            arms ? "; only then is its watchdog register written, before the first command" : ""));
  }

  void check_jacket(MapReader& in, const IoSection& io) {
    const control::JacketSettings& jacket = config().controller.jacket;
    if (jacket.form == control::JacketForm::off || in.describing()) return;
    using Source = ValvePosition::Source;
    if (config().valve_position.source == Source::none && !in.given("valve_position")) {
      in.error("missing key 'valve_position' (`read_back` or {model: [effects]})");
    }
    const bool may_act = !jacket.shadow || switches_on(config().monitor.corrective);
    if (may_act && interlocks_of(jacket, {}).paper) {
      in.error("form",
               "paper acts in simulate and compare only, since it can park the loop off its set "
               "point. Add shadow: true, or use bounded or dwell");
    }
    if (!io.known) return;
    if (config().valve_position.source == Source::read_back && !io.has_read_back) {
      in.error("valve_position", fmt::format("read_back is missing: the io section (at {}) has no "
                                             "read_back; add it or state a model of the valve",
                                             to_text(in_.place("io"))));
    }
    if (may_act && interlocks_of(jacket, backing_of(io.io)).max_mean_error) {
      in.error(
          "missing key 'max_mean_error' (number > 0, PV units; required where the jacket acts "
          "on hardware)");
    }
  }

  void check_compensator(MapReader& in, const IoSection& io) {
    const control::ControllerSettings& controller = config().controller;
    const control::CompensatorSettings& c = controller.compensator;
    if (c.kind == control::CompensatorKind::none || in.describing()) return;
    check_gain(in, c, controller.pid.action);
    if (c.shadow) return;
    if (control::acts_in_simulation_only(c.kind)) {
      in.error("kind", fmt::format("{} acts in simulate and compare only. Add shadow: true, or use "
                                   "planned_moves, backlash or hysteresis",
                                   to_text(c.kind)));
    }
    const control::JacketSettings& jacket = controller.jacket;
    const bool jacket_acts = !jacket.shadow || switches_on(config().monitor.corrective);
    if (jacket.form != control::JacketForm::off && jacket_acts) {
      in.error(
          "kind",
          fmt::format(
              "{} can't act together with the jacket, which {}; set shadow: true for one of them",
              to_text(c.kind), jacket.shadow ? "corrective_action switches on" : "acts"));
    }
    if (!io.known) return;
    const Backing backing = backing_of(io.io);
    if (const char* key = lacks(c, backing)) {
      in.error(fmt::format("missing key '{}' (required where {} acts on hardware)", key,
                           to_text(c.kind)));
    }
    if (too_wide(c, backing)) {
      in.error(
          "s_interval",
          "wider than a factor of two: planned_moves does not act on hardware; add shadow: true");
    }
    if (c.kind != control::CompensatorKind::planned_moves) return;
    if (!c.planned.read_back && backing.hardware) {
      in.error("read_back",
               "planned_moves acts on hardware only with a read-back; add shadow: true");
    }
    if (c.planned.read_back && !io.has_read_back) {
      in.error(
          "read_back",
          fmt::format("is missing: the io section (at {}) has no read_back; add it, or set false",
                      to_text(in_.place("io"))));
    }
  }

  MapReader& in_;
  const DaemonConfig& daemon_;
  LoopFile loop_;
  bool watched_ = false;     // another controller runs the loop
  bool stop_known_ = false;  // the stop action has no error
  Value<double> sample_time_;
  Value<double> max_age_;
  RangeValue pv_range_;
  RangeValue output_range_;
  RangeValue output_limits_;
  RangeValue sp_limits_;
  std::optional<MapReader> compensator_;
  std::optional<MapReader> corrective_;
};

}  // namespace

bool is_usable_tag(std::string_view tag) {
  constexpr std::size_t kLongestTag = 32;
  return !tag.empty() && tag.size() <= kLongestTag && (is_letter(tag[0]) || is_digit(tag[0])) &&
         std::all_of(tag.begin(), tag.end(), [](char c) {
           return is_letter(c) || is_digit(c) || c == '-' || c == '_' || c == '.';
         });
}

LoopFile read_loop(MapReader& in, const std::string& file, const DaemonConfig& daemon) {
  const Value<bool> elsewhere = in.one_of("control", kControls, kControlMeaning, false);
  if (elsewhere) return LoopReader(in, file, daemon).read_watched();
  return LoopReader(in, file, daemon).read();
}

LoopFile read_watched_loop(MapReader& in, const std::string& file, const DaemonConfig& daemon) {
  in.declare("control", "elsewhere", Presence::required, "", kControlMeaning);
  return LoopReader(in, file, daemon).read_watched();
}

}  // namespace loopwarden::config
