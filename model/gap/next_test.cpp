// SPDX-License-Identifier: Apache-2.0
#include "model/gap/next_test.hpp"

#include "model/estimator/judge_test.hpp"
#include "model/gap/constants.hpp"

namespace loopwarden::gap {

void plan_next_test(const std::vector<estimator::Explanation>& explanations,
                    const estimator::TestStart& start, const numeric::ParallelFor& parallel,
                    Result& result) {
  std::vector<estimator::Explanation> competing;
  std::vector<std::size_t> index;
  for (std::size_t i = 0; i < explanations.size(); ++i) {
    const estimator::Explanation& one = explanations[i];
    if (one.probability < estimator::kCompetes || one.samples.empty()) continue;
    competing.push_back(one);
    index.push_back(i);
    for (plant::LoopModel& sample : competing.back().samples) {
      std::erase_if(sample.disturbances, [](const effects::EffectSpec& effect) {
        return effect.name == "step_disturbance" || effect.name == "ramp_disturbance";
      });
    }
    if (competing.size() == kMostCompeting) break;
  }
  if (competing.size() < 2) return;
  estimator::TestStart of_competing = start;
  if (start.judge) {
    of_competing.judge = [&](const estimator::Observed& test) {
      return estimator::among(start.judge(test), index);
    };
  }
  const estimator::Planned planned = estimator::propose_test(competing, of_competing, parallel);
  result.why_no_test = planned.why_not;
  if (!planned.plan) return;
  std::vector<Probability> names;
  for (const estimator::Explanation& one : competing) {
    names.push_back({one.effects, one.probability});
  }
  result.next_test = {std::move(names), *planned.plan, planned.next};
}

estimator::TestStart test_start(const plant::LoopModel& model, double set_point, double output) {
  const control::PidSettings& pid = model.controller.pid;
  return {.set_point = set_point,
          .output = output,
          .set_points = {model.transmitter.low, model.transmitter.high},
          .outputs = {pid.output_low, pid.output_high}};
}

}  // namespace loopwarden::gap
