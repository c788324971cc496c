// SPDX-License-Identifier: Apache-2.0
#include "config/io_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <system_error>
#include <tuple>

#include "config/analog_reader.hpp"
#include "config/loop_model_reader.hpp"
#include "config/modbus_reader.hpp"
#include "config/source_file.hpp"

namespace loopwarden::config {
namespace {

using hal::sim::IoFault;

enum class Backend { simulated, modbus, analog, replay };
constexpr auto kBackends = std::to_array<Choice<Backend>>({{"simulated", Backend::simulated},
                                                           {"modbus", Backend::modbus},
                                                           {"analog", Backend::analog},
                                                           {"replay", Backend::replay}});

constexpr auto kIoFaults =
    std::to_array<Choice<IoFault::Kind>>({{"dead_sensor", IoFault::Kind::dead_sensor},
                                          {"frozen", IoFault::Kind::frozen},
                                          {"not_a_number", IoFault::Kind::not_a_number},
                                          {"link_lost", IoFault::Kind::link_lost},
                                          {"output_lost", IoFault::Kind::output_lost},
                                          {"enable_open", IoFault::Kind::enable_open}});

// Checks that the model belongs to this loop.
void check_model(MapReader& in, const IoContext& context, const plant::LoopModel& model,
                 const std::string& model_file) {
  if (context.sample_time.valid && model.sample_time_s != context.sample_time) {
    in.error("model", fmt::format("{}: its sample_time is {} s, this loop's is {} s (at {})",
                                  model_file, brief(model.sample_time_s),
                                  brief(context.sample_time), to_text(context.sample_time.place)));
  }
  const auto differs = [](const Value<std::pair<double, double>>& range, double low, double high) {
    return range.valid && (range.value.first != low || range.value.second != high);
  };
  const control::PidSettings& pid = model.controller.pid;
  if (differs(context.output_range, pid.output_low, pid.output_high)) {
    in.error("model", fmt::format("{}: its controller.output is [{}, {}], this loop's output range "
                                  "is another (at {})",
                                  model_file, brief(pid.output_low), brief(pid.output_high),
                                  to_text(context.output_range.place)));
  }
  if (differs(context.pv_range, model.transmitter.low, model.transmitter.high)) {
    in.error("model", fmt::format("{}: its transmitter.range is [{}, {}], this loop's range is "
                                  "another (at {})",
                                  model_file, brief(model.transmitter.low),
                                  brief(model.transmitter.high), to_text(context.pv_range.place)));
  }
}

void read_simulated(MapReader in, const IoContext& context, IoSection& section) {
  SimIo sim;
  section.has_read_back = true;  // the simulated stem
  const Value<std::string> model = in.need_text("model", "loop model file; relative to this file");
  sim.output_resolution =
      in.number("output_resolution",
                {"CO units", at_least(0.0), "step of the simulated converter; 0: continuous"}, 0.0);
  section.output_resolution = sim.output_resolution;
  for (MapReader& item : in.maybe_list("io_faults", "faults between plant and controller")) {
    IoFault fault;
    fault.kind = item.need_one_of("fault", kIoFaults, "kind of fault");
    const Value<double> from =
        item.need_number("from", {"s", at_least(0.0), "when it begins, simulated time"});
    const Value<double> to = item.need_number("to", {"s", at_least(0.0), "when it ends"});
    if (from.valid && to.valid && to <= from) {
      item.error("to", fmt::format("must be after from = {} s (at {}) (got {})", brief(from),
                                   to_text(from.place), brief(to)));
    }
    fault.from_s = from;
    fault.to_s = to;
    sim.io_faults.push_back(fault);
  }
  if (model.given && model.valid) {
    const std::string file = resolve(context.file, model);
    Loaded<plant::LoopModel> loaded_model = read_model_file(file);
    for (const Diagnostic& diagnostic : loaded_model.diagnostics) {
      if (diagnostic.level == Diagnostic::Level::error) in.error("model", to_text(diagnostic));
    }
    if (loaded_model) {
      section.output_known = true;
      sim.model = std::move(*loaded_model);
      check_model(in, context, sim.model, file);
    }
  }
  section.io = std::move(sim);
}

void read_replay(MapReader in, const IoContext& context, IoSection& section) {
  hal::replay::ReplaySettings replay;
  section.has_read_back = true;  // the record's column `stem`, if it has one
  const Value<std::string> record =
      in.need_text("record", "CSV record with the loop's sample time; relative to this file");
  replay.repeat =
      in.flag("repeat", "start again at the end; otherwise PV becomes bad there", false);
  replay.output_resolution =
      in.number("output_resolution",
                {"CO units", at_least(0.0), "step of the recorded converter; 0: continuous"}, 0.0);
  section.output_resolution = replay.output_resolution;
  section.record = record.place;
  replay.sample_time_s = context.sample_time;
  std::tie(replay.output_low, replay.output_high) = context.output_range.value;
  if (record.given && record.valid) {
    replay.record = resolve(context.file, record);
    std::error_code error;
    if (!std::filesystem::is_regular_file(replay.record, error)) {
      in.error("record", fmt::format("{} is no readable file", replay.record));
    } else {
      section.output_known = true;
    }
  }
  section.io = std::move(replay);
}

}  // namespace

IoSection read_io(MapReader& in, const IoContext& context) {
  IoSection section;
  section.command = in.place();
  if (!in.describing() && in.word("backend") == "feed") {
    in.error("backend",
             "feed needs `control: elsewhere`, because values of a feeder must not move a valve");
    in.ignore_rest();
    return section;
  }
  const Value<Backend> backend = in.need_one_of("backend", kBackends, "what the loop is wired to");
  section.known = backend.valid && backend.given;
  if (!section.known && !in.describing()) {
    in.ignore_rest();
    return section;
  }
  const auto chosen = [&](Backend which) { return in.describing() || backend == which; };
  if (chosen(Backend::simulated)) read_simulated(in.variant("simulated"), context, section);
  if (chosen(Backend::modbus)) read_modbus(in.variant("modbus"), context, section);
  if (chosen(Backend::analog)) read_analog(in.variant("analog"), context, section);
  if (chosen(Backend::replay)) read_replay(in.variant("replay"), context, section);
  return section;
}

std::int64_t nanoseconds(double seconds) noexcept { return std::llround(seconds * 1e9); }

Value<double> read_poll_period(MapReader& in, const IoContext& context, const Interval& range) {
  Value<double> period =
      in.number("poll_period", {"s", range, "interval of requests to the devices", "sample_time"},
                std::clamp(context.sample_time.value, range.low, range.high));
  if (period.valid && context.max_age.valid && period > context.max_age) {
    in.error("poll_period",
             fmt::format("must be at most max_age = {} s (at {}), or PV is stale "
                         "between two polls (got {})",
                         brief(context.max_age), to_text(context.max_age.place), brief(period)));
  }
  return period;
}

std::optional<std::int64_t> read_max_command_age(MapReader& in, const IoContext& context) {
  const Value<double> age =
      in.maybe_number("max_command_age",
                      {"s", between(0.01, 3600.0),
                       "an older command is not output, so that a watchdog acts if the loop hangs",
                       "three poll periods and 0.1 s"});
  if (!age.given) return std::nullopt;
  if (age.valid && context.sample_time.valid && age <= context.sample_time) {
    in.error(
        "max_command_age",
        fmt::format("must be longer than sample_time = {} s (at {}) (got {})",
                    brief(context.sample_time), to_text(context.sample_time.place), brief(age)));
  }
  return nanoseconds(age);
}

CommLoss read_comm_loss(MapReader& in, const char* value_text,
                        const std::function<void(MapReader&)>& read_register) {
  constexpr const char* kKey = "comm_loss";
  constexpr const char* kMeaning =
      "protection that moves the valve if no command arrives: link down, kill -9, SIGSTOP. Only "
      "the device can do this";
  constexpr auto kDevice = std::to_array<Choice<bool>>({{"device", true}});
  CommLoss loss;
  if (!in.describing() && !in.given(kKey)) {
    in.error(
        fmt::format("missing key 'comm_loss' ({}). When the link is down, or this process is "
                    "killed or stopped, only the device's own watchdog can bring the valve to a "
                    "safe place: state the protection, or accept that the device has none",
                    value_text));
    in.declare(kKey, value_text, Presence::optional, "", kMeaning);
    return loss;
  }
  in.declare(kKey, value_text, Presence::required, "", kMeaning);
  if (in.word(kKey) == "none_accepted") return loss;
  std::optional<MapReader> watchdog;
  if (in.describing() || in.kind(kKey) == YamlNode::Kind::map)
    watchdog = in.maybe_section(kKey, kMeaning);
  const bool says_who = watchdog && (watchdog->describing() || watchdog->given("set_by") ||
                                     (read_register && watchdog->given("register")));
  if (!says_who) in.error(kKey, fmt::format("must be {}", value_text));
  if (!watchdog) return loss;
  loss.device_acts = true;
  loss.timeout = watchdog->need_number(
      "timeout", {"s", between(0.1, 3600.0), "time without a command after which the device acts"});
  if (!says_who) {
    for (const char* key : {"set_by", "register", "value"})
      watchdog->declare(key, "", Presence::optional, "", "");
    return loss;
  }
  const bool by_device = watchdog->given("set_by");
  if (by_device || watchdog->describing() || !read_register) {
    watchdog->need_one_of("set_by", kDevice, "the watchdog is configured on the device itself");
  }
  if (read_register && (!by_device || watchdog->given("register"))) {
    if (by_device) {
      watchdog->error("register", fmt::format("conflicts with set_by (at {}); give one of them",
                                              to_text(watchdog->place("set_by"))));
    }
    read_register(*watchdog);
  }
  return loss;
}

}  // namespace loopwarden::config
