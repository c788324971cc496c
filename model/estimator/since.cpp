// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/since.hpp"

#include <algorithm>
#include <string_view>

namespace loopwarden::estimator {
namespace {

// A moment counts as two parameters (Zhang and Siegmund, Biometrics 63 (2007) 22-32).
constexpr int kMomentParameters = 2;
constexpr double kFirstStep = 0.1;  // of the moments

bool has_own_times(const Candidate& candidate) {
  const effects::Descriptor* info = effects::find_effect(candidate.name);
  return candidate.at_one_moment || candidate.wanders_on ||
         (info != nullptr && effects::has_own_times(*info));
}

}  // namespace

std::vector<Law> laws_since(const std::vector<Candidate>& catalogue, double duration_s,
                            Moments moments) {
  const effects::SearchRange moment{
      "from", moments.earliest_s, std::max(moments.latest_s, moments.earliest_s + 1e-3), false,
      1,      kFirstStep};
  std::vector<Law> laws;
  for (const Candidate& candidate : catalogue) {
    Law law = law_of(candidate, duration_s);
    if (std::string_view(law.name) == "step_disturbance") {
      law.search[0].low = moment.low;
      law.search[0].high = moment.high;
      laws.push_back(std::move(law));
      continue;
    }
    // A bias that begins is a step.
    if (has_own_times(candidate) || candidate.is_level) continue;
    if (law.solves_gain) law = stepped_gain(std::move(law));
    // The stem rests at CO before.
    if (law.starts_offset()) {
      law.search.pop_back();
      law.resting_half_band = nullptr;
    }
    law.timing = Law::Timing::since;
    law.moment = moment;
    law.parameters += kMomentParameters;
    laws.push_back(std::move(law));
  }
  return laws;
}

}  // namespace loopwarden::estimator
