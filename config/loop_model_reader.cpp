// SPDX-License-Identifier: Apache-2.0
#include "config/loop_model_reader.hpp"

#include <fmt/format.h>

#include <array>
#include <limits>
#include <tuple>

#include "config/document.hpp"
#include "config/controller_reader.hpp"
#include "config/effect_reader.hpp"
#include "config/map_reader.hpp"

namespace loopwarden::config {
namespace {

using effects::Block;

constexpr double kMostDeadTimeSamples = 1e6;  // limit of the delay line
constexpr auto kProcessKinds = std::to_array<Choice<plant::ProcessKind>>(
    {{"self_regulating", plant::ProcessKind::self_regulating},
     {"integrating", plant::ProcessKind::integrating}});
constexpr double kMostTransmitterSteps = 1e12;  // range / resolution, exact in a double

std::optional<double> span_of(const Value<std::pair<double, double>>& range) {
  if (!range.valid || !range.given) return std::nullopt;
  return range.value.second - range.value.first;
}

class ModelReader {
 public:
  explicit ModelReader(MapReader root) : root_(std::move(root)) {}

  plant::LoopModel read() {
    sample_time_ = read_sample_time(root_);
    model_.sample_time_s = sample_time_.valid ? sample_time_.value : 0.1;
    std::optional<MapReader> controller =
        root_.need_section("controller", "what the loop runs with");
    std::optional<MapReader> valve = read_valve();
    std::optional<MapReader> process = root_.need_section("process", "between flow and PV");
    std::optional<MapReader> transmitter = root_.need_section("transmitter", "transmitter of PV");
    if (transmitter) read_transmitter(*transmitter);
    if (controller) read_controller(*controller);
    context_ = {.sample_time_s = model_.sample_time_s,
                .output_low = model_.controller.pid.output_low,
                .output_high = model_.controller.pid.output_high};
    if (valve) {
      model_.valve_effects = read_effects(*valve, "effects", Block::valve, context_,
                                          "in the order in which CO meets them");
    }
    if (process) read_process(*process);
    if (transmitter) {
      model_.transmitter_effects = read_effects(*transmitter, "effects", Block::transmitter,
                                                context_, "in the order in which PV meets them");
    }
    model_.disturbances =
        read_effects(root_, "disturbances", Block::disturbance, context_, "signals added to PV");
    root_.maybe_section("scenario", "scenario of `loopwarden simulate`",
                        [&](MapReader& scenario) { read_scenario(scenario); });
    root_.maybe_section("twin", "uncertainty of the commissioned model, for training and model_gap",
                        [&](MapReader& twin) { read_twin(twin); });
    return std::move(model_);
  }

 private:
  // Reads a section, or the word none.
  std::optional<MapReader> read_valve() {
    constexpr const char* kMeaning =
        "between CO and flow; `valve: none` states that the actuator can't stick (a heater, a "
        "pump, a "
        "drive)";
    if (root_.word("valve") != "none") return root_.maybe_section("valve", kMeaning);
    root_.declare("valve", "mapping, or none", Presence::optional, "", kMeaning);
    model_.has_valve = false;
    return std::nullopt;
  }

  void read_transmitter(MapReader& in) {
    plant::TransmitterParameters& transmitter = model_.transmitter;
    pv_range_ = in.need_range("range", {"PV units", any_number(), "of the transmitter"});
    const Value<double> resolution = in.number(
        "resolution", {"PV units", at_least(0.0), "step of the converter; 0: continuous"}, 0.0);
    transmitter.resolution = resolution;
    transmitter.noise = in.number("noise", {"PV units", at_least(0.0), "standard deviation"}, 0.0);
    const std::optional<double> span = span_of(pv_range_);
    if (!span) return;
    std::tie(transmitter.low, transmitter.high) = pv_range_.value;
    if (resolution > 0.0 && *span / resolution > kMostTransmitterSteps) {
      in.error("resolution",
               fmt::format("is too fine for range (at {})", to_text(pv_range_.place)));
    }
    if (resolution > *span) {
      in.error("resolution",
               fmt::format("must be at most the span of range, {} PV units (at {}) "
                           "(got {})",
                           brief(*span), to_text(pv_range_.place), brief(resolution)));
    }
  }

  void read_controller(MapReader& in) {
    control::ControllerSettings& controller = model_.controller;
    const Value<std::pair<double, double>> output =
        in.need_range("output", {"CO units", any_number(), "range of the controller output"});
    controller.pid.gains = read_gains(in, span_of(pv_range_), span_of(output));
    controller.pid.action =
        in.one_of("action", kActions, "reverse: PV up, output down", control::Action::reverse);
    read_anti_windup(in, control::AntiWindup::integral_clamp, controller.pid);
    const Value<double> rate = in.maybe_number(
        "rate_limit", {"CO units/s", above(0.0), "fastest change of the output", "none"});
    const Value<double> deadband =
        in.number("deadband", {"CO units", at_least(0.0), "smaller changes are not output"}, 0.0);
    in.maybe_section("jacket", "the stickband jacket",
                     [&](MapReader& jacket) { controller.jacket = read_jacket(jacket); });
    in.maybe_section("compensator", "correction of CO against the valve's fault",
                     [&](MapReader& compensator) {
                       controller.compensator = read_compensator(compensator);
                       check_gain(compensator, controller.compensator, controller.pid.action);
                     });
    if (output.valid && output.given) {
      std::tie(controller.pid.output_low, controller.pid.output_high) = output.value;
    }
    controller.pid.tolerance = deadband;
    controller.output = {.low = controller.pid.output_low, .high = controller.pid.output_high};
    if (rate.given) controller.output.rate_per_s = rate;
    controller.output.deadband = deadband;
    // A set point outside the transmitter's range can't be reached.
    controller.set_point = {.low = model_.transmitter.low, .high = model_.transmitter.high};
  }

  void read_process(MapReader& in) {
    plant::ProcessParameters& process = model_.process;
    process.kind =
        in.one_of("kind", kProcessKinds, "integrating: PV keeps changing while CO is off balance",
                  plant::ProcessKind::self_regulating);
    const Value<double> gain =
        in.need_number("gain", {"PV units/CO unit", any_number(),
                                "steady-state gain, not 0; integrating: PV units/(CO unit s)"});
    if (gain.valid && gain == 0.0) in.error("gain", "must not be 0");
    process.gain = gain;
    read_level(in);
    read_lags(in);
    context_.time_constant_s = process.time_constant_s;
    const Value<double> dead_time = in.need_number("dead_time", {"s", at_least(0.0), "dead time"});
    process.dead_time_s = dead_time;
    if (dead_time.valid && sample_time_.valid && dead_time > kMostDeadTimeSamples * sample_time_) {
      in.error("dead_time", fmt::format("must be at most {} sample times (sample_time at {})",
                                        brief(kMostDeadTimeSamples), to_text(sample_time_.place)));
    }
    if (std::optional<MapReader> uncertainty = in.maybe_section(
            "uncertainty", "relative; a change by a fit up to this does not count as an effect")) {
      const auto read = [&](const char* key, double fallback) {
        return uncertainty->number(key, {"", between(0.0, 1.0), "relative"}, fallback).value;
      };
      plant::ProcessUncertainty& u = model_.uncertainty;
      u.gain = read("gain", u.gain);
      u.time_constant = read("time_constant", u.time_constant);
      u.dead_time = read("dead_time", u.dead_time);
    }
    model_.process_effects = read_effects(in, "effects", Block::process, context_,
                                          "in the order in which the flow meets them");
  }

  void read_level(MapReader& in) {
    const Value<double> level =
        in.maybe_number("level", {"PV units", any_number(),
                                  "PV at CO 0 without disturbance (room temperature, static head); "
                                  "self_regulating only; a simulation takes 0",
                                  "estimated from the record"});
    if (level.given && model_.process.integrating()) {
      in.error(
          "level",
          "does not go with `kind: integrating`: such a process rests at every level. Remove it");
    } else if (level.given && level.valid) {
      model_.process.level = level.value;
    }
  }

  void read_lags(MapReader& in) {
    plant::ProcessParameters& process = model_.process;
    const NumberRule rule{"s", above(0.0), "of the first-order lag; self_regulating only"};
    if (!process.integrating()) {
      process.time_constant_s = in.need_number("time_constant", rule);
    } else if (in.maybe_number("time_constant", rule).given) {
      in.error("time_constant",
               "does not go with `kind: integrating`; use second_time_constant for a lag in "
               "addition to the integrator");
    }
    process.second_time_constant_s = in.number(
        "second_time_constant", {"s", at_least(0.0), "of a second lag; 0: no second lag"}, 0.0);
  }

  void read_twin(MapReader& in) {
    static const std::vector<std::string> kNames{"gain", "time_constant", "dead_time"};
    const Value<std::vector<std::string>> parameters =
        in.maybe_words("parameters", kNames, "parameters of the rows of covariance");
    const Value<std::vector<std::vector<double>>> covariance =
        in.maybe_table("covariance", "", "of the parameters' natural logarithms");
    plant::TwinFit twin;
    if (std::optional<MapReader> watch = in.maybe_section(
            "watch", "statistics of the healthy record: limits of model_gap and load_outside")) {
      twin.largest =
          watch->number("change", {"", at_least(0.0), "largest statistic; 0: unknown"}, 0.0);
      const NumberRule old{"", at_least(0.0), "accepted from older twins and ignored"};
      watch->number("size", old, 0.0);
      watch->number("colour", old, 0.0);
      const NumberRule any{"PV units", {}, "of the healthy record's PV"};
      watch->set_number("pv_low", any, twin.seen_low);
      watch->set_number("pv_high", any, twin.seen_high);
      const NumberRule co{"CO units", {}, "of the healthy record's CO"};
      watch->set_number("co_low", co, twin.co_low);
      watch->set_number("co_high", co, twin.co_high);
      const auto load_mean =
          watch->maybe_number("load", {"PV units", {}, "mean of PV less the twin's"});
      const NumberRule of_load{"PV units", at_least(0.0), "of the load, over minutes"};
      const double deviation = watch->number("load_deviation", of_load, 0.0);
      const double step = watch->number("load_step", of_load, 0.0);
      if (load_mean.given) twin.load = {load_mean.value, deviation, step};
      const NumberRule of_co{"CO units", at_least(0.0),
                             "of CO relative to the output of the twin's controller"};
      const auto rms = watch->maybe_number("controller_rms", of_co);
      const double resolution =
          watch->number("co_resolution", {"CO units", at_least(0.0), "of CO"}, 0.0);
      if (rms.given) twin.controller = {rms.value, resolution};
    }
    if (in.describing() || (parameters.given && !parameters.valid) ||
        (covariance.given && !covariance.valid)) {
      return;
    }
    const std::size_t size = parameters.value.size();
    bool sound = covariance.value.size() == size;
    for (std::size_t i = 0; sound && i < size; ++i) {
      sound = covariance.value[i].size() == size && covariance.value[i][i] >= 0.0;
    }
    for (std::size_t i = 0; sound && i < size; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        sound = sound && covariance.value[i][j] == covariance.value[j][i];
      }
    }
    if (!sound) {
      in.error("covariance",
               fmt::format("must have {0} row{1} of {0}, alike across the diagonal, which is not "
                           "below 0",
                           size, size == 1 ? "" : "s"));
      return;
    }
    twin.parameters = parameters.value;
    twin.covariance = covariance.value;
    model_.twin = std::move(twin);
  }

  void read_scenario(MapReader& in) {
    plant::Scenario& scenario = model_.scenario;
    constexpr double kLongest = 1e9;  // s
    in.set_number("duration",
                  {"s", {.low = 0.0, .high = kLongest, .low_is_open = true}, "of the run"},
                  scenario.duration_s);
    const Value<std::vector<std::pair<double, double>>> set_point = in.maybe_points(
        "set_point", "[[t, v], ...]", "from t (s) on the set point is v (PV units); first t is 0");
    scenario.set_point = set_point;
    if (set_point.given && set_point.valid) check_set_point(in, set_point);
    constexpr std::int64_t kLargestSeed = std::numeric_limits<std::int64_t>::max();
    scenario.seed = static_cast<std::uint64_t>(
        in.integer("seed", {0, kLargestSeed, "", "seed of all random numbers"}, 1));
    scenario.faults = read_faults(in, context_);
    for (const plant::ScheduledFault& fault : scenario.faults) {
      if (model_.has_valve || fault.block != Block::valve) continue;
      in.error("faults",
               fmt::format("{} is a valve's, and the model states `valve: none`. Remove one "
                           "of them",
                           fault.effect.name));
    }
  }

  void check_set_point(MapReader& in, const std::vector<std::pair<double, double>>& points) {
    if (points.empty() || points.front().first != 0.0) {
      in.error("set_point", "must begin at t = 0");
      return;
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (i > 0 && points[i].first <= points[i - 1].first) {
        in.error("set_point", fmt::format("t must rise (see point {})", i + 1));
      }
      const double value = points[i].second;
      if (pv_range_.given && pv_range_.valid &&
          (value < pv_range_.value.first || value > pv_range_.value.second)) {
        in.error("set_point", fmt::format("must lie within transmitter.range (at {}) (got {})",
                                          to_text(pv_range_.place), brief(value)));
      }
    }
  }

  MapReader root_;
  plant::LoopModel model_;
  effects::EffectContext context_;
  Value<double> sample_time_;
  Value<std::pair<double, double>> pv_range_;
};

}  // namespace

Loaded<plant::LoopModel> read_model_text(const std::string& file, std::string_view text) {
  return load_text<plant::LoopModel>(file, text,
                                     [&](MapReader& in) { return ModelReader(in).read(); });
}

Loaded<plant::LoopModel> read_model_file(const std::filesystem::path& path) {
  return load_file(path, read_model_text);
}

KeyReference describe_model() {
  return keys_of([](MapReader& in) { ModelReader(in).read(); });
}

}  // namespace loopwarden::config
