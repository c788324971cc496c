// SPDX-License-Identifier: Apache-2.0
// Searches for one effect among a few names, for the tests of single effects.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "model/effects/catalogue.hpp"
#include "model/estimator/estimate.hpp"
#include "tests/model/gap/gap_support.hpp"

namespace loopwarden::test {

struct Named {
  std::string first;
  effects::EffectSpec effect;
  double lead_nats = 0.0;  // over the next name
  plant::LoopModel corrected;
};

// Searches for a single effect among `names`, in 130 s of `truth` with SP steps.
inline Named named_among(const std::vector<std::string>& names, const plant::LoopModel& truth) {
  const numeric::LoopRecord record = record_of(truth, 130.0);
  estimator::Options options{.without = {"learned"}, .most_effects = 1};
  for (const effects::Descriptor& info : effects::effect_catalogue()) {
    if (std::find(names.begin(), names.end(), info.name) == names.end()) {
      options.without.emplace_back(info.name);
    }
  }
  const estimator::Estimate found = estimator::estimate(
      {record.period_s, record.co, record.pv, std::vector<bool>(record.size(), true)},
      believed_model(), options, serial);
  Named out;
  out.corrected = found.corrected;
  bool first = true;
  for (const estimator::Ranked& ranked : found.ranked) {
    if (ranked.effects.empty()) continue;
    const effects::EffectSpec& effect = ranked.effects[0];
    if (first) {
      out.first = effect.name;
      out.effect = effect;
      out.lead_nats = ranked.score;
      first = false;
    } else if (effect.name != out.first) {
      out.lead_nats -= ranked.score;
      return out;
    }
  }
  return out;
}

}  // namespace loopwarden::test
