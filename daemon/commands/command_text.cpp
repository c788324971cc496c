// SPDX-License-Identifier: Apache-2.0
#include "daemon/commands/command_text.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <string>

namespace loopwarden::daemon::commands {

std::string gains_text(const control::PidGains& gains) {
  return fmt::format("kp {} ki {} kd {}", gains.kp, gains.ki, gains.kd);
}

std::string why_refused(rt::Refusal refusal, const rt::Command& command,
                        const rt::LoopSettings& settings) {
  const auto limits = [](const char* what, double low, double high, double got) {
    return fmt::format("{} must be within {:g} to {:g} (got {:.9g})", what, low, high, got);
  };
  const control::ControllerSettings& controller = settings.controller;
  if (refusal == rt::Refusal::set_point_out_of_limits && command.set_point) {
    return limits("set point", controller.set_point.low, controller.set_point.high,
                  *command.set_point);
  }
  if (refusal == rt::Refusal::output_out_of_limits && command.output) {
    return limits("output", controller.output.low, controller.output.high, *command.output);
  }
  return rt::to_text(refusal);
}

std::string why_refused(const rt::CommandAnswer& answer, const rt::Command& command,
                        const rt::LoopSettings& settings) {
  const auto text = [](double value) {
    return std::isfinite(value) ? fmt::format("{:.9g}", value) : std::string("not known");
  };
  const auto number = [&](const char* what, double now, const std::optional<double>& expected) {
    return fmt::format("the {} is now {}, {} was expected", what, text(now),
                       text(expected.value_or(now)));
  };
  const rt::Expectation& expected = command.expected;
  switch (answer.refusal) {
    case rt::Refusal::mode_changed:
      return fmt::format("the mode is now {}, {} was expected", control::to_text(answer.now.mode),
                         control::to_text(expected.mode.value_or(answer.now.mode)));
    case rt::Refusal::set_point_changed:
      return number("set point", answer.now.set_point, expected.set_point);
    case rt::Refusal::output_changed: return number("output", answer.now.output, expected.output);
    case rt::Refusal::gains_changed:
      return fmt::format(
          "the gains are now {}, {} were expected",
          gains_text({answer.now.kp, answer.now.ki, answer.now.kd}),
          gains_text({expected.kp.value_or(answer.now.kp), expected.ki.value_or(answer.now.ki),
                      expected.kd.value_or(answer.now.kd)}));
    default: return why_refused(answer.refusal, command, settings);
  }
}

}  // namespace loopwarden::daemon::commands
