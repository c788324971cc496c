// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/valve_test_text.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "workbench/text/next_test_text.hpp"

namespace loopwarden::workbench {
namespace {

std::vector<std::string> names_of(const diagnosis::ValveTest& test) {
  if (test.names_effect) return {"stiction", "backlash", "good valve"};
  return {"stiction or backlash", "good valve"};
}

double percent(double part, double whole) { return 100.0 * std::abs(part) / whole; }

}  // namespace

std::string valve_test_text(const diagnosis::ValveTest& test, const std::vector<double>& co_range) {
  const double co_span = co_range[1] - co_range[0];
  if (!test.planned.plan) {
    return fmt::format("no move of CO tells a band of {:.2g} % from a good valve. {}",
                       percent(test.band, co_span), test.planned.why_not);
  }
  const estimator::TestPlan& plan = *test.planned.plan;
  return fmt::format(
      "{} That is {:.2g} % of the CO span, or {:.2g} times the band. PV deviates by up to {:.2g} "
      "(class up to {:.0f} % of its span of {:.3g}{}: {}). {} Right decisions: {:.0f} %.",
      test_sentence(plan), percent(plan.move.size, co_span), std::abs(plan.move.size) / test.band,
      plan.pv_swing, 100.0 * plan.class_share, test.pv_span,
      test.pv_span_known ? "" : ", assumed", allowed_by(plan.class_share),
      outcomes_sentence(plan, names_of(test)), 100.0 * plan.probability_right);
}

nlohmann::json valve_test_json(const diagnosis::ValveTest& test,
                               const std::vector<double>& co_range) {
  const double co_span = co_range[1] - co_range[0];
  nlohmann::json out = {{"text", valve_test_text(test, co_range)},
                        {"band_percent_of_span", percent(test.band, co_span)},
                        {"pv_span", test.pv_span},
                        {"pv_span_known", test.pv_span_known},
                        {"move", nullptr}};
  if (!test.planned.plan) return out;
  const estimator::TestPlan& plan = *test.planned.plan;
  const std::vector<std::string> names = names_of(test);
  const std::vector<std::array<double, 2>> changes = outcomes_of(plan);
  out["move"] = estimator::to_text(plan.move.kind);
  out["from"] = plan.moved.back();
  out["size"] = plan.move.size;
  out["size_percent_of_span"] = percent(plan.move.size, co_span);
  out["size_in_bands"] = std::abs(plan.move.size) / test.band;
  out["hold_s"] = plan.move.hold_s;
  out["duration_s"] = plan.duration_s;
  out["allowed_by"] = allowed_by(plan.class_share);
  out["class_percent"] = 100.0 * plan.class_share;
  out["pv_swing"] = plan.pv_swing;
  out["probability_right"] = plan.probability_right;
  out["probability_wrong"] = plan.probability_wrong;
  out["expected"] = nlohmann::json::array();
  for (std::size_t i = 0; i < names.size(); ++i) {
    out["expected"].push_back({{"if", names[i]}, {"pv_change", changes[i]}});
  }
  return out;
}

}  // namespace loopwarden::workbench
