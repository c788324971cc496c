// SPDX-License-Identifier: Apache-2.0
#include "config/corrective_reader.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "config/interlocks.hpp"

namespace loopwarden::config {
namespace {

using alarm::CorrectiveForm;
using alarm::CorrectiveSettings;

constexpr auto kCorrectiveForms = std::to_array<Choice<CorrectiveForm>>(
    {{"jacket", CorrectiveForm::jacket}, {"planned_moves", CorrectiveForm::planned_moves}});

void check_jacket_form(MapReader& in, const control::ControllerSettings& controller,
                       const WindowCut& monitor) {
  for (const char* key : {"on_order", "max_move", "max_moves_per_hour"}) {
    if (in.given(key)) in.error(key, "applies only to form planned_moves");
  }
  const control::JacketSettings& jacket = controller.jacket;
  using Form = control::JacketForm;
  if ((jacket.form != Form::bounded && jacket.form != Form::dwell) || !jacket.shadow) {
    in.error("enabled",
             "needs controller.jacket with form bounded or dwell and shadow: true, from which it "
             "is switched on");
  }
  if (monitor.specialists.empty()) {
    in.error("enabled", "needs specialists, which detect a sticking valve");
  }
}

void check_moves_form(MapReader& in, const control::ControllerSettings& controller,
                      const WindowCut& monitor) {
  if (in.given("allowed_mean_error")) in.error("allowed_mean_error", "applies only to form jacket");
  if (monitor.twin.empty()) {
    in.error("form", "planned_moves needs monitor.twin, which explains the alarm");
  }
  if (controller.compensator.kind != control::CompensatorKind::none) {
    in.error("form", "planned_moves replaces controller.compensator. Remove the compensator");
  }
  if (controller.jacket.form != control::JacketForm::off && !controller.jacket.shadow) {
    in.error("form", "planned_moves can't act together with the jacket. Set shadow: true there");
  }
}

}  // namespace

void read_corrective_action(MapReader& in, const control::ControllerSettings& controller,
                            WindowCut& monitor) {
  CorrectiveSettings& corrective = monitor.corrective;
  corrective.enabled = in.flag("enabled", "false: same as if absent", true);
  corrective.form = in.one_of("form", kCorrectiveForms,
                              "planned_moves: once the twin has explained the alarm; in shadow for "
                              "ten minutes first",
                              CorrectiveForm::jacket);
  in.set_number("allowed_mean_error",
                {"% of PV span", between(0.0, 100.0),
                 "mean of SP - PV that the jacket may cause, if it was smaller before"},
                corrective.allowed_mean_error_percent);
  in.set_flag("on_order", "planned_moves are offered, and begin at a person's command",
              corrective.on_order);
  in.maybe_number("max_move",
                  {"CO units", above(0.0),
                   "longest single move of the stem by planned_moves; a detour, for less than j, "
                   "needs 1.15 j more",
                   "none; required on hardware"},
                  corrective.max_move);
  in.maybe_number("max_moves_per_hour",
                  {"1/h", above(0.0), "most planned_moves in any hour; a detour is two",
                   "none; required on hardware"},
                  corrective.max_moves_per_hour);
  if (in.describing() || !corrective.enabled) return;
  corrective.form == CorrectiveForm::jacket ? check_jacket_form(in, controller, monitor)
                                            : check_moves_form(in, controller, monitor);
}

void check_corrective_io(MapReader& in, const CorrectiveSettings& corrective, const IoSection& io) {
  if (!corrective.enabled || corrective.form != CorrectiveForm::planned_moves || !io.known) return;
  if (!io.has_read_back) in.error("form", "planned_moves needs a read_back in the io section");
  if (moves_may_act(corrective, backing_of(io.io))) return;
  const auto required = [&](const char* key, double value) {
    if (std::isfinite(value)) return;
    in.error(fmt::format("missing key '{}' (required where planned_moves act on hardware)", key));
  };
  required("max_move", corrective.max_move);
  required("max_moves_per_hour", corrective.max_moves_per_hour);
}

bool switches_on(const CorrectiveSettings& corrective) noexcept {
  return corrective.enabled && corrective.form == CorrectiveForm::jacket;
}

}  // namespace loopwarden::config
