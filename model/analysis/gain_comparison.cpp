// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/gain_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "model/control/pid.hpp"
#include "model/numeric/enum_name.hpp"
#include "model/plant/process.hpp"

namespace loopwarden::analysis {
namespace {

std::vector<double> disturbance_of(const numeric::LoopView& record, const plant::LoopModel& model) {
  plant::Process process(model.process, record.period_s);
  std::vector<double> d{record.pv[0] - process.reset(record.co[0])};
  for (std::size_t k = 1; k < record.pv.size(); ++k)
    d.push_back(record.pv[k] - process.step(record.co[k - 1]));
  return d;
}

double simulated_rms(const numeric::LoopView& record, const plant::LoopModel& model,
                     const std::vector<double>& disturbance, const control::PidGains& gains) {
  control::PidSettings settings = model.controller.pid;
  settings.gains = gains;
  control::Pid pid(settings, record.period_s);
  plant::Process process(model.process, record.period_s);
  double co = record.co[0];
  double pv = process.reset(co) + disturbance[0];
  pid.initialise(co, record.sp[0], pv);
  double squares = 0.0;
  for (std::size_t k = 0; k + 1 < disturbance.size(); ++k) {
    squares += (record.sp[k] - pv) * (record.sp[k] - pv);
    co = std::clamp(pid.step(record.sp[k], pv, co, 0.0), settings.output_low, settings.output_high);
    pv = process.step(co) + disturbance[k + 1];
  }
  return std::sqrt(squares / static_cast<double>(disturbance.size() - 1));
}

// Returns whether the model reproduces the measured RMS.
bool fits(double simulated, double measured) noexcept {
  return std::max(simulated / measured, measured / simulated) <= GainLimits::kModelFits;
}

}  // namespace

std::optional<std::array<double, 2>> compare_gains(const numeric::LoopView& record,
                                                   const plant::LoopModel& model,
                                                   const std::array<control::PidGains, 2>& gains) {
  constexpr std::size_t kLeast = 100;
  if (record.pv.size() < kLeast || record.sp.size() != record.pv.size() ||
      record.co.size() != record.pv.size())
    return std::nullopt;
  const std::vector<double> disturbance = disturbance_of(record, model);
  std::array<double, 2> rms{};
  for (std::size_t k = 0; k < gains.size(); ++k) {
    rms[k] = simulated_rms(record, model, disturbance, gains[k]);
    if (!std::isfinite(rms[k])) return std::nullopt;
  }
  return rms;
}

const char* to_text(GainResult result) noexcept {
  return numeric::enum_name<GainResult::cant_tell>(
      result, {"improved", "worse", "no_difference", "cant_tell"});
}

GainChange judge_gains(const GainRecord& before, const GainRecord& after) {
  if (!before.by_model || !after.by_model) {
    return {GainResult::cant_tell,
            "gains can be compared only with a model of the loop, and with records that have SP"};
  }
  const auto& [old_before, new_before] = *before.by_model;
  const auto& [old_after, new_after] = *after.by_model;
  if (!fits(old_before, before.rms) || !fits(new_after, after.rms)) {
    return {GainResult::cant_tell, "the model does not reproduce the records"};
  }
  const double least = std::min(new_before / old_before, new_after / old_after);
  const double most = std::max(new_before / old_before, new_after / old_after);
  if (most <= GainLimits::kAlike) {
    return {GainResult::improved, "on the same disturbance SP - PV is smaller"};
  }
  if (least >= 1.0 / GainLimits::kAlike) {
    return {GainResult::worse, "on the same disturbance SP - PV is larger"};
  }
  if (least > GainLimits::kAlike && most < 1.0 / GainLimits::kAlike) {
    return {GainResult::no_difference, "on the same disturbance SP - PV changes by less than 10 %"};
  }
  return {GainResult::cant_tell, "the disturbances before and after give different answers"};
}

}  // namespace loopwarden::analysis
