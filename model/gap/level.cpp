// SPDX-License-Identifier: Apache-2.0
#include "model/gap/level.hpp"

#include <cmath>
#include <span>
#include <vector>

#include "model/gap/constants.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::gap {
namespace {

constexpr int kEvaluations = 150;
constexpr Fitter::Evolution kPolish{.evaluations = 3840, .seed = 1, .wide = false};

}  // namespace

LevelFinding find_level(Fitter& fitter, const SearchResult& search, const Scale& scale) {
  const Fit& with = search.chosen.fit;
  LevelFinding out;
  out.level = fitter.fitted_level(with);
  out.spread = fitter.level_spread(with);
  const std::vector<double> left_with = fitter.left_out_innovations(with, kGainBlocks);

  fitter.hold_level(true);
  out.base = fitter.fit_model();
  out.base_rmse = fitter.training_rmse(out.base);
  Fit without = out.base;
  if (!with.terms.empty()) without = fitter.polish(fitter.refine(with, kEvaluations), kPolish);
  const std::vector<double> left_without = fitter.left_out_innovations(without, kGainBlocks);
  fitter.hold_level(false);

  out.chosen = search.chosen;
  out.chosen.fit = without;
  out.chosen.training_rmse = fitter.training_rmse(without);
  const double deviance_less = without.deviance - with.deviance;
  out.lead_nats = 0.5 * (deviance_less - std::log(static_cast<double>(with.samples)));
  const Lead lead = lead_between(left_with, left_without, deviance_less);
  const std::vector<double> pv = fitter.simulate(with);
  out.shown =
      worth_adding({.score_with = out.lead_nats,
                    .score_without = 0.0,
                    .first = with.terms.empty(),
                    .moves_pv = numeric::rms_apart(std::span(pv).first(fitter.training_end()),
                                                   fitter.simulate(without)),
                    .least_rms = scale.least_rms,
                    .left_out_nats = lead.nats,
                    .block_t = lead.t,
                    .rmse_with = search.chosen.training_rmse,
                    .rmse_without = out.chosen.training_rmse,
                    .rmse_model = search.base_rmse,
                    .noise_rms = scale.noise_rms});
  return out;
}

}  // namespace loopwarden::gap
