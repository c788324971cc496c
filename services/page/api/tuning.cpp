// SPDX-License-Identifier: Apache-2.0
// Proposes gains for a loop and compares them with those in force. It sets no values.
#include "services/page/tuning/proposal.hpp"

#include <algorithm>
#include <mutex>
#include <optional>

#include "base/clock.hpp"
#include "config/loop_model_reader.hpp"
#include "daemon/protocol/ask.hpp"
#include "model/analysis/limits.hpp"
#include "services/page/api/body.hpp"
#include "services/page/api/handlers.hpp"
#include "services/page/api/tags.hpp"

namespace loopwarden::page::api {
namespace {

using nlohmann::json;

constexpr std::size_t kMostPoints = 500;  // of a simulated curve

tuning::LoopFacts facts_of(const protocol::LoopAnswer& now) {
  const protocol::LoopGains gains = now.status.gains.value_or(protocol::LoopGains{});
  return {.sample_time_s = now.status.sample_time_s,
          .pv_range = now.ranges.pv_range,
          .output_limits = now.ranges.output_limits,
          .gains = {.kp = gains.in_force.kp,
                    .ki = gains.in_force.ki,
                    .kd = gains.in_force.kd,
                    .derivative_filter_s = gains.derivative_filter_s}};
}

json process_json(const plant::ProcessParameters& process) {
  return {{"kind", plant::to_text(process.kind)},
          {"gain", process.gain},
          {"time_constant_s", process.integrating() ? json() : json(process.time_constant_s)},
          {"second_time_constant_s", process.second_time_constant_s},
          {"dead_time_s", process.dead_time_s}};
}

// Returns every `every`-th sample of a curve.
json curve(const std::vector<double>& values, std::size_t every) {
  json points = json::array();
  for (std::size_t i = 0; i < values.size(); i += every) points.push_back(values[i]);
  return points;
}

json trial_json(const analysis::RuleTrial& trial, std::size_t every) {
  const analysis::PredictedResponse& response = trial.response;
  return {{"rule", trial.rule ? json(analysis::to_text(*trial.rule)) : json()},
          {"gains", protocol::Gains{trial.gains.kp, trial.gains.ki, trial.gains.kd}},
          {"scales_with_gain", trial.scales()},
          {"stable", trial.margins.stable},
          {"gain_margin", trial.margins.gain_margin},
          {"phase_margin_deg", trial.margins.phase_margin_deg},
          {"sensitivity", trial.margins.sensitivity},
          {"settles", response.settles},
          {"rise_10_90_s", response.step.rise_10_90_s},
          {"overshoot_percent", 100.0 * response.step.overshoot},
          {"settling_2_percent_s", response.step.settling_2_s},
          {"load_absolute_error", response.load_absolute_error},
          {"pv", curve(response.record.pv, every)},
          {"co", curve(response.record.co, every)}};
}

json answers_json(const tuning::Proposal& proposal) {
  const analysis::SimulatedRecord& first = proposal.trials.front().response.record;
  const std::size_t every = first.pv.size() / kMostPoints + 1;
  json time = json::array();
  for (std::size_t i = 0; i < first.pv.size(); i += every) {
    time.push_back(static_cast<double>(i) * first.period_s);
  }
  json rules = json::array();
  for (const analysis::RuleTrial& trial : proposal.trials) {
    rules.push_back(trial_json(trial, every));
  }
  return {
      {"rules", std::move(rules)},
      {"recommended", proposal.recommended ? json(*proposal.recommended) : json()},
      {"most_sensitivity", analysis::AnalysisLimits::kMostSensitivity},
      {"t", std::move(time)},
      {"sp", curve(first.sp, every)},
      {"load_s", static_cast<double>(proposal.trials.front().response.load_from) * first.period_s}};
}

plant::LoopModel twin_of(Context& context, const std::string& tag) {
  const auto told = ask(context.daemon, protocol::TwinRequest{tag});
  if (!told.model) throw ApiError(409, "this loop has no twin", "model");
  auto loaded = config::read_model_text(tag, *told.model);
  if (!loaded.value) throw ApiError(409, "this page can't read the twin: it is of another version");
  return std::move(*loaded.value);
}

// Returns the process identified from the record. Notes about it are added to `about`.
std::optional<plant::LoopModel> from_record(Context& context, const BoxState& state,
                                            const protocol::LoopDescription& loop,
                                            const tuning::LoopFacts& facts, json& about) {
  const control::PidGains& gains = facts.gains;
  const auto record =
      tuning::newest_step(context.history, segments_of(context, loop),
                          {.sample_time_s = facts.sample_time_s,
                           .ms_per_s = 1000.0 / state.about.accelerate,
                           .integral_time_s = gains.ki > 0.0 ? gains.kp / gains.ki : 0.0,
                           .pv_span = facts.pv_range[1] - facts.pv_range[0],
                           .now_ms = base::utc_ms()});
  if (!record) {
    about["why_not"] = "The record has no step of the set point in automatic.";
    about["settle"] =
        "Step the set point by a few percent of PV's range, wait until PV has "
        "settled, and try again.";
    return std::nullopt;
  }
  about["step_ms"] = record->step_ms;
  about["from_ms"] = record->from_ms;
  about["to_ms"] = record->to_ms;
  tuning::Identified found = tuning::identified(*record, facts);
  about["notes"] = found.notes;
  if (!found.model) {
    about["why_not"] = found.why_not;
    about["settle"] = found.settle;
    return std::nullopt;
  }
  about["fit_percent"] = found.fit_percent;
  about["intervals"] = {{"gain", found.gain},
                        {"time_constant_s", found.time_constant_s},
                        {"dead_time_s", found.dead_time_s}};
  return std::move(found.model);
}

}  // namespace

http::Response proposed_gains(Context& context, const Call& call) {
  // One at a time: an identification occupies a processor, and a thread that histories need.
  static std::mutex one_at_a_time;
  check_query(call.request, {"model", "form"});
  const auto state = context.now().state;
  const protocol::LoopDescription& loop = loop_at(state, call.request.part(2));
  check_may_tune(*state, loop);
  std::string model = text_in(call.request, "model", 16);
  if (model.empty()) model = loop.twin ? "twin" : "record";
  if (model != "twin" && model != "record") throw ApiError(400, "twin or record", "model");
  const std::string form = text_in(call.request, "form", 16);
  if (!form.empty() && form != "pi" && form != "pid") throw ApiError(400, "pi or pid", "form");
  const std::unique_lock lock(one_at_a_time, std::try_to_lock);
  if (!lock) throw ApiError(503, "gains are being calculated for another request; try again");

  const auto now = ask(context.daemon, protocol::LoopRequest{loop.tag});
  const tuning::LoopFacts facts = facts_of(now);
  const bool pid = form == "pid";
  if (pid && !(facts.gains.derivative_filter_s > 0.0)) {
    throw ApiError(409,
                   "PID settings need controller.derivative_filter in the loop's file, which an "
                   "order of gains does not change",
                   "form");
  }
  json about = {{"source", model}, {"has_twin", loop.twin}};
  const std::optional<plant::LoopModel> found =
      model == "twin" ? std::optional(tuning::model_of(twin_of(context, loop.tag), facts))
                      : from_record(context, *state, loop, facts, about);
  json answer = json::object();
  if (found) {
    about["process"] = process_json(found->process);
    answer = answers_json(tuning::propose(
        *found, facts, pid ? analysis::ControllerForm::pid : analysis::ControllerForm::pi));
  }
  answer["model"] = std::move(about);
  answer["in_force"] = now.status.gains ? json(*now.status.gains) : json();
  answer["can_pid"] = facts.gains.derivative_filter_s > 0.0;
  return json_response(answer);
}

}  // namespace loopwarden::page::api
