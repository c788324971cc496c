// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/deciding_test_text.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "workbench/text/next_test_text.hpp"

namespace loopwarden::workbench {
namespace {

std::vector<std::string> explanations_of(const diagnosis::DecidingTest& test) {
  if (test.names_effect) return {"stiction", "backlash", "good valve"};
  return {"stiction or backlash", "good valve"};
}

double percent(double part, double whole) { return 100.0 * std::abs(part) / whole; }

}  // namespace

std::string deciding_test_text(const diagnosis::DecidingTest& test,
                               const std::vector<double>& co_range) {
  const std::string assumed =
      test.pv_span_known
          ? ""
          : fmt::format(" The span of PV is assumed: {:.3g} PV units.", test.pv_span);
  if (const auto& plan = test.planned.plan)
    return proposed_test_text(*plan, explanations_of(test)) + assumed;
  const std::string none = "No move of CO decides and adds at most 5 % of the span of PV.";
  if (!test.planned.beyond) {
    return fmt::format(
        "{} Neither does one within 20 %: the disturbance hides a band of {:.2g} % of the CO span. "
        "Record an hour with set points that move.{}",
        none, percent(test.band, co_range[1] - co_range[0]), assumed);
  }
  return fmt::format("{} The smallest move that decides is larger. {}{}", none,
                     proposed_test_text(*test.planned.beyond, explanations_of(test)), assumed);
}

nlohmann::json deciding_test_json(const diagnosis::DecidingTest& test,
                                  const std::vector<double>& co_range) {
  const double co_span = co_range[1] - co_range[0];
  nlohmann::json out = {{"text", deciding_test_text(test, co_range)},
                        {"band_percent_of_span", percent(test.band, co_span)},
                        {"pv_span", test.pv_span},
                        {"pv_span_known", test.pv_span_known},
                        {"move", nullptr}};
  const bool within = test.planned.plan.has_value();
  if (!within && !test.planned.beyond) return out;
  const estimator::TestPlan& plan = within ? *test.planned.plan : *test.planned.beyond;
  const std::vector<std::string> names = explanations_of(test);
  const std::vector<std::array<double, 2>> changes = outcomes_of(plan);
  out["move"] = estimator::to_text(plan.move.kind);
  out["from"] = plan.moved.back();
  out["size"] = plan.move.size;
  out["size_percent_of_span"] = percent(plan.move.size, co_span);
  out["size_in_bands"] = std::abs(plan.move.size) / test.band;
  out["hold_s"] = plan.move.hold_s;
  out["duration_s"] = plan.duration_s;
  out["allowed_by"] = within ? nlohmann::json(allowed_by(plan.class_share)) : nullptr;
  out["pv_swing"] = plan.pv_swing;
  out["pv_added_percent_of_span"] = 100.0 * plan.class_share;
  out["probability_right"] = plan.probability_right;
  out["probability_wrong"] = plan.probability_wrong;
  out["expected"] = nlohmann::json::array();
  for (std::size_t i = 0; i < names.size(); ++i) {
    out["expected"].push_back({{"if", names[i]}, {"pv_change", changes[i]}});
  }
  return out;
}

}  // namespace loopwarden::workbench
