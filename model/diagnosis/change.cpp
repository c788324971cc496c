// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/change.hpp"

#include <algorithm>
#include <cmath>

#include "model/numeric/enum_name.hpp"

namespace loopwarden::diagnosis {
namespace {

constexpr const char* kLess = "SP - PV is smaller by more than its spread";
constexpr const char* kMore = "SP - PV is larger by more than its spread";

// Returns the result if both ratios (after / before) agree. `limit`: below 1.
Change agreed(double first, double second, double limit, const char* less, const char* more,
              const char* neither) {
  if (std::max(first, second) <= limit) return {ChangeResult::improved, less};
  if (std::min(first, second) >= 1.0 / limit) return {ChangeResult::worse, more};
  return {ChangeResult::cant_tell, neither};
}

Change judge_by_model(const ChangeSide& before, const ChangeSide& after) {
  const auto fits = [](double simulated, double measured) {
    return std::max(simulated / measured, measured / simulated) <= ChangeLimits::kModelFits;
  };
  const auto& [old_before, new_before] = *before.by_model;
  const auto& [old_after, new_after] = *after.by_model;
  if (!fits(old_before, before.rms) || !fits(new_after, after.rms))
    return {ChangeResult::cant_tell, "the model does not reproduce the records"};
  const double first = new_before / old_before;
  const double second = new_after / old_after;
  constexpr double kAlike = ChangeLimits::kByModel;
  if (std::min(first, second) > kAlike && std::max(first, second) < 1.0 / kAlike)
    return {ChangeResult::no_difference,
            "on the same disturbance SP - PV changes by less than 10 %"};
  return agreed(first, second, kAlike, "on the same disturbance SP - PV is smaller",
                "on the same disturbance SP - PV is larger",
                "the disturbances before and after give different answers");
}

double movement_of(std::span<const double> sp) {
  double movement = 0.0;
  for (std::size_t k = 1; k < sp.size(); ++k) movement += std::abs(sp[k] - sp[k - 1]);
  return movement / static_cast<double>(std::max<std::size_t>(1, sp.size()));
}

// Mean and variance of the mean of the logarithm of the RMS of eight parts.
std::array<double, 2> log_rms_of(const numeric::LoopView& record) {
  constexpr std::size_t kParts = 8;
  std::array<double, kParts> logs{};
  for (std::size_t part = 0; part < kParts; ++part) {
    const std::size_t from = record.pv.size() * part / kParts;
    const std::size_t to = record.pv.size() * (part + 1) / kParts;
    double squares = 0.0;
    for (std::size_t k = from; k < to; ++k)
      squares += (record.sp[k] - record.pv[k]) * (record.sp[k] - record.pv[k]);
    logs[part] = 0.5 * std::log(squares / static_cast<double>(to - from));
  }
  double mean = 0.0;
  for (const double one : logs) mean += one / kParts;
  double variance = 0.0;
  for (const double one : logs) variance += (one - mean) * (one - mean) / (kParts - 1);
  return {mean, variance / kParts};
}

Change judge_by_records(const ChangeSide& before, const ChangeSide& after) {
  constexpr std::size_t kLeast = 100;
  const auto has_error = [](const ChangeSide& side) {
    return side.record.pv.size() >= kLeast && side.record.sp.size() == side.record.pv.size();
  };
  if (!has_error(before) || !has_error(after) || !(before.unpredicted > 0.0) ||
      !(after.unpredicted > 0.0))
    return {ChangeResult::cant_tell, "a record has no SP, or is too short"};
  const double moved_before = movement_of(before.record.sp);
  const double moved_after = movement_of(after.record.sp);
  if (std::max(moved_before, moved_after) >
      ChangeLimits::kSetPoints * std::min(moved_before, moved_after))
    return {ChangeResult::cant_tell, "SP moves more in one record than in the other"};
  const auto [mean_before, variance_before] = log_rms_of(before.record);
  const auto [mean_after, variance_after] = log_rms_of(after.record);
  constexpr double kStudent = 2.98;  // 99 %, 14 degrees of freedom
  const double spread = kStudent * std::sqrt(variance_before + variance_after);
  const double ratio = after.rms / before.rms;
  if (!(std::abs(mean_after - mean_before) > spread))
    return {ChangeResult::cant_tell, "SP - PV differs by less than its spread"};
  return agreed(ratio, ratio * before.unpredicted / after.unpredicted, ChangeLimits::kByRecords,
                kLess, kMore, "another disturbance can be the cause of the difference");
}

}  // namespace

const char* to_text(ChangeResult result) noexcept {
  return numeric::enum_name<ChangeResult::cant_tell>(
      result, {"improved", "worse", "no_difference", "cant_tell"});
}

Change judge_change(const ChangeSide& before, const ChangeSide& after) {
  return before.by_model && after.by_model ? judge_by_model(before, after)
                                           : judge_by_records(before, after);
}

}  // namespace loopwarden::diagnosis
