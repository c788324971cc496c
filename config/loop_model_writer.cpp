// SPDX-License-Identifier: Apache-2.0
#include "config/loop_model_writer.hpp"

#include <fmt/format.h>

#include <cmath>
#include <sstream>
#include <string_view>
#include <vector>

#include "model/effects/catalogue.hpp"

namespace loopwarden::config {
namespace {

using effects::EffectSpec;

// {} prints the fewest digits that read back to the same double.
std::string number(double value) { return fmt::format("{}", value); }

std::string pair(double a, double b) { return fmt::format("[{}, {}]", number(a), number(b)); }

std::string points(const std::vector<std::pair<double, double>>& values) {
  std::string text;
  for (const auto& [x, y] : values)
    text += fmt::format("{}{}", text.empty() ? "" : ", ", pair(x, y));
  return fmt::format("[{}]", text);
}

// Returns `, s: 0.9, j: 0.3`, in the order of the catalogue.
std::string parameters(const EffectSpec& spec) {
  std::string text;
  const effects::Descriptor* info = effects::find_effect(spec.name);
  if (info == nullptr) return text;
  for (const effects::ParameterInfo& parameter : info->parameters) {
    const auto found = spec.parameters.find(parameter.name);
    if (found != spec.parameters.end()) {
      text += fmt::format(", {}: {}", parameter.name, number(found->second));
    }
  }
  return text;
}

std::string list(const std::vector<std::pair<double, double>>& values, bool second) {
  std::string text;
  for (const auto& [a, b] : values) {
    text += fmt::format("{}{}", text.empty() ? "" : ", ", number(second ? b : a));
  }
  return fmt::format("[{}]", text);
}

// Returns a YAML scalar in double quotes.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

std::string learned_keys(const EffectSpec& spec) {
  const auto form = spec.options.find("form");
  const std::string name = form != spec.options.end() ? form->second : "static";
  std::string text = "effect: learned";
  if (form != spec.options.end()) text += fmt::format(", form: {}", name);
  if (name == "hysteretic") {
    text += fmt::format(", thresholds: {}, weights: {}", list(spec.table, false),
                        list(spec.table, true));
  } else if (name == "dynamic") {
    text += fmt::format(", numerator: {}, denominator: {}", list(spec.table, false),
                        list(spec.table, true));
  } else {
    text += fmt::format(", table: {}", points(spec.table));
  }
  text += parameters(spec);
  for (const auto& [key, value] : spec.options) {
    if (key == "over") text += fmt::format(", over: {}", value);
    if (key == "description") text += fmt::format(", description: {}", quoted(value));
  }
  return text;
}

// Returns `effect: stiction, s: 0.9, j: 0.3`.
std::string effect_keys(const EffectSpec& spec) {
  const effects::Descriptor* known = effects::find_effect(spec.name);
  if (known != nullptr && known->is_learned) return learned_keys(spec);
  std::string text = fmt::format("effect: {}", spec.name);
  if (!spec.table.empty()) return fmt::format("{}, table: {}", text, points(spec.table));
  if (known != nullptr && known->takes_table) {
    const auto curve = spec.options.find("curve");
    const char* name =
        curve != spec.options.end() ? curve->second.c_str() : known->options.front().values.front();
    return fmt::format("{}, curve: {{name: {}{}}}", text, name, parameters(spec));
  }
  text += parameters(spec);
  for (const auto& [key, value] : spec.options) text += fmt::format(", {}: {}", key, value);
  return text;
}

class ModelWriter {
 public:
  std::string write(const plant::LoopModel& model) {
    line(0, "sample_time", number(model.sample_time_s), "s");
    write_controller(model.controller);
    if (model.has_valve) {
      line(0, "valve");
      effects(2, "effects", model.valve_effects);
    } else {
      line(0, "valve", "none");
    }
    write_process(model);
    line(0, "transmitter");
    line(2, "range", pair(model.transmitter.low, model.transmitter.high), "PV units");
    line(2, "resolution", number(model.transmitter.resolution));
    line(2, "noise", number(model.transmitter.noise), "standard deviation");
    if (!model.transmitter_effects.empty()) effects(2, "effects", model.transmitter_effects);
    if (!model.disturbances.empty()) effects(0, "disturbances", model.disturbances);
    write_scenario(model.scenario);
    if (model.twin) write_twin(*model.twin);
    return std::move(text_);
  }

 private:
  void line(std::size_t indentation, std::string_view key, std::string_view value = "",
            std::string_view comment = "") {
    text_ += fmt::format("{:{}}{}:{}{}{}{}\n", "", indentation, key, value.empty() ? "" : " ",
                         value, comment.empty() ? "" : "  # ", comment);
  }

  void effects(std::size_t indentation, std::string_view key,
               const std::vector<EffectSpec>& specs) {
    line(indentation, key, specs.empty() ? "[]" : "");
    for (const EffectSpec& spec : specs) item(indentation, effect_keys(spec));
  }

  void item(std::size_t indentation, std::string_view keys) {
    text_ += fmt::format("{:{}}- {{{}}}\n", "", indentation + 2, keys);
  }

  void write_controller(const control::ControllerSettings& controller) {
    const control::PidSettings& pid = controller.pid;
    line(0, "controller");
    line(2, "action", pid.action == control::Action::direct ? "direct" : "reverse");
    line(2, "kp", number(pid.gains.kp), "CO units/PV unit");
    line(2, "ki", number(pid.gains.ki), "CO units/(PV unit s)");
    if (pid.gains.kd != 0.0) line(2, "kd", number(pid.gains.kd), "CO units s/PV unit");
    if (pid.gains.derivative_filter_s != 0.0) {
      line(2, "derivative_filter", number(pid.gains.derivative_filter_s), "s");
    }
    line(2, "output", pair(pid.output_low, pid.output_high), "CO units");
    line(2, "anti_windup", to_text(pid.anti_windup));
    if (pid.tracking_time_s != 0.0) line(2, "tracking_time", number(pid.tracking_time_s), "s");
    if (std::isfinite(controller.output.rate_per_s)) {
      line(2, "rate_limit", number(controller.output.rate_per_s), "CO units/s");
    }
    if (controller.output.deadband != 0.0) {
      line(2, "deadband", number(controller.output.deadband), "CO units");
    }
    if (controller.jacket != control::JacketSettings{}) write_jacket(controller.jacket);
    if (controller.compensator != control::CompensatorSettings{}) {
      write_compensator(controller.compensator);
    }
  }

  void write_compensator(const control::CompensatorSettings& c) {
    using Kind = control::CompensatorKind;
    line(2, "compensator");
    line(4, "kind", control::to_text(c.kind));
    line(4, "shadow", c.shadow ? "true" : "false");
    if (std::isfinite(c.limit)) line(4, "limit", number(c.limit), "CO units");
    if (c.kind == Kind::knocker) {
      line(4, "amplitude", number(c.amplitude), "CO units");
      line(4, "pulse_period", number(c.pulse_period_s), "s");
      line(4, "pulse_width", number(c.pulse_width_s), "s");
    }
    if (c.kind == Kind::two_move) {
      line(4, "stick_band", number(c.stick_band), "CO units");
      line(4, "factor", number(c.factor));
      line(4, "move_time", number(c.move_time_s), "s");
      line(4, "max_mean_error", number(c.max_mean_error), "PV units");
      line(4, "mean_error_time", number(c.mean_error_time_s), "s");
    }
    if (c.kind == Kind::reinforcement) line(4, "amplitude", number(c.amplitude), "CO units");
    if (c.kind == Kind::backlash) line(4, "gap", number(c.gap), "CO units");
    if (c.kind == Kind::hysteresis) {
      if (c.width > 0.0) line(4, "width", number(c.width), "CO units");
      if (c.offset > 0.0) line(4, "offset", number(c.offset), "CO units");
      line(4, "knee", number(c.knee));
    }
    if (c.kind == Kind::planned_moves) write_planned_moves(c.planned);
    if (c.noise_band > 0.0) line(4, "noise_band", number(c.noise_band), "CO units");
  }

  void write_planned_moves(const control::PlannedMovesSettings& m) {
    line(4, "process");
    line(6, "gain", number(m.gain), "PV units/CO unit");
    line(6, "time_constant", number(m.time_constant_s), "s");
    line(6, "dead_time", number(m.dead_time_s), "s");
    line(4, "actuator_lag", number(m.actuator_lag_s), "s");
    line(4, "load", number(m.load), "PV units/sqrt(s)");
    line(4, "s", number(m.s), "CO units");
    if (m.s_high > m.s_low) line(4, "s_interval", pair(m.s_low, m.s_high), "CO units");
    line(4, "j", number(m.j), "CO units");
    if (m.j_high > m.j_low) line(4, "j_interval", pair(m.j_low, m.j_high), "CO units");
    if (std::isfinite(m.max_move)) line(4, "max_move", number(m.max_move), "CO units");
    if (std::isfinite(m.max_moves_per_hour)) {
      line(4, "max_moves_per_hour", number(m.max_moves_per_hour), "1/h");
    }
    line(4, "read_back", m.read_back ? "true" : "false");
  }

  void write_jacket(const control::JacketSettings& jacket) {
    line(2, "jacket");
    line(4, "form", to_text(jacket.form));
    line(4, "shadow", jacket.shadow ? "true" : "false");
    line(4, "ks", number(jacket.gain_per_s), "1/s");
    line(4, "dead_zone", number(jacket.dead_zone), "CO units");
    if (std::isfinite(jacket.max_mean_error)) {
      line(4, "max_mean_error", number(jacket.max_mean_error), "PV units");
    }
    line(4, "mean_error_time", number(jacket.mean_error_time_s), "s");
  }

  void write_process(const plant::LoopModel& model) {
    const plant::ProcessUncertainty& u = model.uncertainty;
    line(0, "process");
    const plant::ProcessParameters& process = model.process;
    if (process.integrating()) {
      line(2, "kind", plant::to_text(process.kind));
      line(2, "gain", number(process.gain), "PV units/(CO unit s)");
    } else {
      line(2, "gain", number(process.gain), "PV units/CO unit");
      line(2, "time_constant", number(process.time_constant_s), "s");
    }
    if (process.level) line(2, "level", number(*process.level), "PV units, PV at CO 0");
    if (process.second_time_constant_s != 0.0) {
      line(2, "second_time_constant", number(process.second_time_constant_s), "s");
    }
    line(2, "dead_time", number(process.dead_time_s), "s");
    line(2, "uncertainty",
         fmt::format("{{gain: {}, time_constant: {}, dead_time: {}}}", number(u.gain),
                     number(u.time_constant), number(u.dead_time)),
         "relative");
    if (!model.process_effects.empty()) effects(2, "effects", model.process_effects);
  }

  static std::string seen(const plant::TwinFit& twin) {
    std::string out;
    const auto add = [&](const char* key, double value) {
      if (std::isfinite(value)) out += fmt::format(", {}: {}", key, number(value));
    };
    add("pv_low", twin.seen_low);
    add("pv_high", twin.seen_high);
    add("co_low", twin.co_low);
    add("co_high", twin.co_high);
    if (twin.load) {
      add("load", twin.load->mean);
      add("load_deviation", twin.load->deviation);
      add("load_step", twin.load->step);
    }
    if (twin.controller) {
      add("controller_rms", twin.controller->rms);
      add("co_resolution", twin.controller->resolution);
    }
    return out;
  }

  void write_twin(const plant::TwinFit& twin) {
    line(0, "twin");
    line(2, "parameters", fmt::format("[{}]", fmt::join(twin.parameters, ", ")));
    line(2, "covariance", "", "of their natural logarithms");
    for (const std::vector<double>& row : twin.covariance) {
      text_ += fmt::format("    - [{}]\n", fmt::join(row, ", "));
    }
    line(2, "watch", fmt::format("{{change: {}{}}}", number(twin.largest), seen(twin)),
         "what the healthy record showed");
  }

  void write_scenario(const plant::Scenario& scenario) {
    line(0, "scenario");
    line(2, "duration", number(scenario.duration_s), "s");
    if (!scenario.set_point.empty()) line(2, "set_point", points(scenario.set_point));
    line(2, "seed", fmt::format("{}", scenario.seed));
    if (scenario.faults.empty()) return;
    line(2, "faults");
    for (const plant::ScheduledFault& fault : scenario.faults) {
      std::string keys =
          fmt::format("{}, block: {}", effect_keys(fault.effect), effects::to_text(fault.block));
      const effects::Schedule& schedule = fault.schedule;
      if (std::isfinite(schedule.from_s)) keys += fmt::format(", from: {}", schedule.from_s);
      if (std::isfinite(schedule.to_s)) keys += fmt::format(", to: {}", schedule.to_s);
      if (schedule.ramp_s != 0.0) keys += fmt::format(", ramp: {}", schedule.ramp_s);
      item(2, keys);
    }
  }

  std::string text_;
};

}  // namespace

std::string write_model(const plant::LoopModel& model, const std::string& heading) {
  std::string text;
  std::istringstream lines(heading);
  for (std::string line; std::getline(lines, line);) text += fmt::format("# {}\n", line);
  return text + ModelWriter().write(model);
}

}  // namespace loopwarden::config
