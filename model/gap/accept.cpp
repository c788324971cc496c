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
  const double gain = a.score_with - a.score_without;
  if (!(a.moves_pv > a.least_rms)) return false;
  if (a.first) return gain > kFirstGain;
  const bool clear = a.at_one_moment || (a.left_out_nats > kFurtherGain && a.block_t > kLeastT);
  return gain > kFurtherGain && clear &&
         closes_a_part(a.rmse_with, a.rmse_without, a.rmse_model, a.noise_rms);
}

bool closes_a_part(double rmse_with, double rmse_without, double rmse_model,
                   double noise_rms) noexcept {
  const double gap = rmse_model * rmse_model - noise_rms * noise_rms;
  return rmse_without * rmse_without - rmse_with * rmse_with > kLeastPart * std::max(gap, 0.0);
}

bool leaves_more(double rmse, const Scale& scale) noexcept {
  return rmse > numeric::root_sum_square(scale.noise_rms, scale.least_rms);
}

bool superfluous(double score_with, double score_without) noexcept {
  return score_with - score_without < kFurtherGain;
}

bool replaces(const EffectSet& rest, const EffectSet& chosen, double rmse_model,
              double noise_rms) noexcept {
  const auto closes = [&](double rmse, double without) {
    return closes_a_part(rmse, without, rmse_model, noise_rms);
  };
  return rest.score > chosen.score || (closes(rest.training_rmse, chosen.training_rmse) &&
                                       !closes(chosen.training_rmse, rmse_model));
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
