// SPDX-License-Identifier: Apache-2.0
#include "model/twin/found_controller.hpp"

#include "model/gap/controller.hpp"
#include "model/numeric/text.hpp"

namespace loopwarden::twin {
namespace {

constexpr double kSure = 0.97;  // the settings follow from CO itself

}  // namespace

std::optional<FoundController> other_controller(const gap::CheckedRecord& checked) {
  if (!checked.quality.usable || checked.closed_loop || checked.sp.empty()) return std::nullopt;
  const gap::ControllerFinding found = gap::compare_controller(checked.record, checked.model);
  if (!found.mismatch) return std::nullopt;
  FoundController out;
  out.exact = found.exact;
  out.before_rmse = found.before_rmse;
  out.after_rmse = found.after_rmse;
  out.effect.spec = {"controller_mismatch", {{"kp", found.kp}, {"ki", found.ki}}};
  out.effect.block = effects::Block::controller;
  out.effect.confidence = kSure;
  out.effect.interval = {
      {"kp", {found.kp - 1.96 * found.kp_spread, found.kp + 1.96 * found.kp_spread}},
      {"ki", {found.ki - 1.96 * found.ki_spread, found.ki + 1.96 * found.ki_spread}}};
  const control::PidGains& given = checked.model.controller.pid.gains;
  out.effect.evidence = numeric::text(
      "CO follows from kp %.4g and ki %.4g instead of %.4g and %.4g: its error falls from %.3g to "
      "%.3g CO units.",
      found.kp, found.ki, given.kp, given.ki, found.before_rmse, found.after_rmse);
  return out;
}

void adopt(const FoundController& found, plant::LoopModel& model) {
  model.controller.pid.gains.kp = found.effect.spec.parameters.at("kp");
  model.controller.pid.gains.ki = found.effect.spec.parameters.at("ki");
}

}  // namespace loopwarden::twin
