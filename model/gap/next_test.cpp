// SPDX-License-Identifier: Apache-2.0
#include "model/gap/next_test.hpp"

#include <algorithm>
#include <utility>

#include "model/estimator/judge_test.hpp"
#include "model/gap/constants.hpp"

namespace loopwarden::gap {

void plan_next_test(const estimator::Estimate& found, const std::vector<Probability>& posterior,
                    estimator::TestStart start, const numeric::ParallelFor& parallel,
                    Result& result) {
  std::vector<estimator::Explanation> competing;
  std::vector<Probability> names;
  std::vector<std::size_t> index;  // in found.explanations
  for (const Probability& h : posterior) {
    const auto same =
        std::find_if(found.explanations.begin(), found.explanations.end(),
                     [&](const estimator::Explanation& e) { return e.effects == h.effects; });
    if (h.probability < estimator::kCompetes || same == found.explanations.end()) continue;
    competing.push_back(*same);
    competing.back().probability = h.probability;
    for (plant::LoopModel& sample : competing.back().samples) {
      std::erase_if(sample.disturbances, [](const effects::EffectSpec& effect) {
        return effect.name == "step_disturbance" || effect.name == "ramp_disturbance";
      });
    }
    names.push_back(h);
    index.push_back(static_cast<std::size_t>(same - found.explanations.begin()));
    if (competing.size() == kMostCompeting) break;
  }
  if (competing.size() < 2) return;
  const plant::LoopModel& model = competing.front().samples.front();
  const double rest_s = estimator::kRest * std::max(plant::answer_s(model), model.sample_time_s);
  start.noise_rms = found.noise_rms;
  start.law_error = found.law_error;
  start.judge = [&](const estimator::Observed& test, estimator::Drawn from) {
    from.explanation = index[from.explanation];
    return estimator::among(found.reweighted(test, rest_s, from).probability, index);
  };
  const estimator::Planned planned = estimator::propose_test(competing, start, parallel);
  result.why_no_test = planned.why_not;
  if (planned.plan) result.next_test = {std::move(names), *planned.plan, planned.next};
}

estimator::TestStart test_start(const plant::LoopModel& model, double set_point, double output) {
  const control::PidSettings& pid = model.controller.pid;
  return {.set_point = set_point,
          .output = output,
          .set_points = {model.transmitter.low, model.transmitter.high},
          .outputs = {pid.output_low, pid.output_high}};
}

}  // namespace loopwarden::gap
