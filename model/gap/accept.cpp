// SPDX-License-Identifier: Apache-2.0
#include "model/gap/accept.hpp"

#include <algorithm>

#include "model/numeric/root_sum_square.hpp"
#include "model/gap/constants.hpp"

namespace loopwarden::gap {

bool EffectSet::has(std::string_view name) const noexcept {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool worth_adding(const Addition& a) noexcept {
  const double gain = a.first ? kFirstGain : kFurtherGain;
  return a.score_with - a.score_without > std::max(gain, kLeastPart * a.score_without) &&
         a.moves_pv > a.least_rms &&
         (a.first || (a.rmse_with < a.rmse_without && (a.at_one_moment || a.block_t > kLeastT)));
}

bool leaves_more(double rmse, const Scale& scale) noexcept {
  return rmse > numeric::root_sum_square(scale.noise_rms, scale.least_rms);
}

bool superfluous(double score_with, double score_without) noexcept {
  return score_with - score_without < kFurtherGain;
}

std::vector<double> leads(const EffectSet& chosen, std::span<const EffectSet> tried) {
  std::vector<double> out;
  for (const std::string& name : chosen.names) {
    double rival = 0.0;  // the model alone
    for (const EffectSet& other : tried) {
      if (other.placed && other.names.size() <= chosen.names.size() && !other.has(name)) {
        rival = std::max(rival, other.score);
      }
    }
    out.push_back(chosen.score - rival);
  }
  return out;
}

}  // namespace loopwarden::gap
