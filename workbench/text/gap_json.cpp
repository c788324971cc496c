// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/gap_json.hpp"

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "workbench/text/json_number.hpp"

namespace loopwarden::workbench {
namespace {

using nlohmann::json;

json numbers(const std::map<std::string, double>& values) {
  json result = json::object();
  for (const auto& [name, value] : values) result[name] = finite_or_null(value);
  return result;
}

// Returns the parameters as in a model file: numbers, choices, and a characteristic as one key
// `curve`.
json parameters_of(const effects::EffectSpec& spec) {
  json result = numbers(spec.parameters);
  for (const auto& [name, value] : spec.options) result[name] = value;
  const auto form = spec.options.find("form");
  if (form != spec.options.end() && (form->second == "hysteretic" || form->second == "dynamic")) {
    const bool plays = form->second == "hysteretic";
    for (const auto& [first, second] : spec.table) {
      result[plays ? "thresholds" : "numerator"].push_back(finite_or_null(first));
      result[plays ? "weights" : "denominator"].push_back(finite_or_null(second));
    }
    return result;
  }
  if (!spec.table.empty()) {
    result.erase("curve");
    for (const auto& [in, out] : spec.table) {
      result["table"].push_back(json::array({finite_or_null(in), finite_or_null(out)}));
    }
  } else if (const auto curve = spec.options.find("curve"); curve != spec.options.end()) {
    json described = numbers(spec.parameters);
    described["name"] = curve->second;
    return {{"curve", std::move(described)}};
  }
  return result;
}

json of(const gap::FoundEffect& effect) {
  json interval = json::object();
  for (const auto& [name, bounds] : effect.interval) {
    interval[name] = json::array({finite_or_null(bounds[0]), finite_or_null(bounds[1])});
  }
  return {{"name", effect.spec.name},
          {"block", effects::to_text(effect.block)},
          {"parameters", parameters_of(effect.spec)},
          {"confidence", finite_or_null(effect.confidence)},
          {"lead_nats", finite_or_null(effect.lead_nats)},
          {"alternatives", effect.alternatives},
          {"interval", std::move(interval)},
          {"evidence", effect.evidence}};
}

json of(const gap::Misfit& misfit) {
  return {{"rmse", finite_or_null(misfit.rmse)},
          {"fit_percent", finite_or_null(misfit.fit_percent)},
          {"training_rmse", finite_or_null(misfit.training_rmse)},
          {"holdout_rmse", finite_or_null(misfit.holdout_rmse)},
          {"holdout_fit_percent", finite_or_null(misfit.holdout_fit_percent)}};
}

json of(const gap::Probability& hypothesis) {
  return {{"effects", hypothesis.effects}, {"probability", finite_or_null(hypothesis.probability)}};
}

json of(const gap::Rest& rest) {
  return {{"is_noise", rest.is_noise},
          {"closed", finite_or_null(rest.closed)},
          {"quiet_rmse", finite_or_null(rest.quiet_rmse)}};
}

json of(const gap::Floor& floor) {
  return {{"transmitter_rmse", finite_or_null(floor.transmitter_rmse)},
          {"load_rmse", finite_or_null(floor.load_rmse)},
          {"load_tested", floor.load_tested},
          {"why_not_tested", floor.why_not_tested}};
}

json of(const gap::Step& step) {
  return {{"added", step.effect},
          {"rmse", finite_or_null(step.rmse)},
          {"holdout_rmse", finite_or_null(step.holdout_rmse)}};
}

json of(const gap::Remainder& remainder) {
  return {{"rmse", finite_or_null(remainder.rmse)},
          {"share", finite_or_null(remainder.share)},
          {"looks_like", gap::to_text(remainder.looks_like)},
          {"depends_on", remainder.depends_on}};
}

json of(const gap::Located& located) {
  return {{"by", gap::to_text(located.by)},
          {"block", effects::to_text(located.block)},
          {"what", located.what},
          {"from_s", finite_or_null(located.from_s)},
          {"to_s", finite_or_null(located.to_s)},
          {"share_of_gap", finite_or_null(located.share_of_gap)}};
}

json of(const gap::TriedCandidate& candidate) {
  return {{"name", candidate.name},
          {"block", effects::to_text(candidate.block)},
          {"parameters", parameters_of(candidate.spec)},
          {"rmse", finite_or_null(candidate.rmse)},
          {"score", finite_or_null(candidate.score)},
          {"chosen", candidate.chosen},
          {"why_not", candidate.why_not}};
}

json of(const gap::RecordCheck& check) {
  json notes = json::array();
  for (const gap::RecordNote& note : check.notes) {
    notes.push_back({{"what", note.what},
                     {"text", note.text},
                     {"from_s", finite_or_null(note.from_s)},
                     {"to_s", finite_or_null(note.to_s)}});
  }
  return {{"usable", check.usable},
          {"refusal", check.refusal},
          {"notes", std::move(notes)},
          {"noise_rms", finite_or_null(check.noise_rms)},
          {"pv_resolution", finite_or_null(check.pv_resolution)},
          {"co_resolution", finite_or_null(check.co_resolution)},
          {"output_reversals", check.output_reversals},
          {"output_span_used", finite_or_null(check.output_span_used)}};
}

json of(const gap::NextTest& test) {
  json names = json::array();
  for (const gap::Probability& h : test.explanations) names.push_back(h.effects);
  return {{"tells_apart", std::move(names)},
          {"file", "next_test.yaml"},
          {"move", estimator::to_text(test.plan.move.kind)},
          {"size", test.plan.move.size},
          {"hold_s", test.plan.move.hold_s},
          {"probability_right", test.plan.probability_right},
          {"probability_wrong", test.plan.probability_wrong},
          {"duration_s", test.plan.duration_s},
          {"pv_swing", test.plan.pv_swing},
          {"output_swing", test.plan.output_swing}};
}

template <class T>
json list_of(const std::vector<T>& items) {
  json result = json::array();
  for (const T& item : items) result.push_back(of(item));
  return result;
}

}  // namespace

json gap_json(const gap::Result& result) {
  return {{"verdict", gap::to_text(result.outcome)},
          {"sentence", result.sentence},
          {"compared", result.closed_loop ? "closed_loop" : "measured_output"},
          {"effects", list_of(result.effects)},
          {"posterior", list_of(result.posterior)},
          {"gap",
           {{"noise_floor_rmse", finite_or_null(result.floor.rmse())},
            {"floor", of(result.floor)},
            {"load_intensity", finite_or_null(result.load_intensity)},
            {"before", of(result.before)},
            {"after", of(result.after)},
            {"rest", of(result.rest)},
            {"controller_before_rmse", finite_or_null(result.controller_before_rmse)},
            {"controller_after_rmse", finite_or_null(result.controller_after_rmse)},
            {"steps", list_of(result.steps)}}},
          {"remainder", result.remainder ? of(*result.remainder) : json()},
          {"located", list_of(result.located)},
          {"candidates", list_of(result.candidates)},
          {"holdout_from_s", finite_or_null(result.holdout_from_s)},
          {"record", of(result.check)},
          {"next_test", result.next_test ? of(*result.next_test) : json()},
          {"why_no_test", result.why_no_test},
          {"corrected_model", "model.corrected.yaml"}};
}

}  // namespace loopwarden::workbench
