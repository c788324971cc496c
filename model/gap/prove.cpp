// SPDX-License-Identifier: Apache-2.0
#include "model/gap/prove.hpp"

#include <algorithm>

#include "model/gap/constants.hpp"

namespace loopwarden::gap {

bool refuted(const Trial& t) noexcept {
  if (t.rest_is_noise) return !(t.choice_innovations < kWorstInnovations * t.model_innovations);
  return t.choice_rmse > kWorstHoldout * t.model_rmse;
}

Trial try_on_holdout(const ModelFit& model_fit, const SearchResult& search,
                     const CheckedRecord& record, bool rest_is_noise, const Misfit& before,
                     const Misfit& after) {
  Trial trial{.rest_is_noise = rest_is_noise,
              .model_rmse = before.holdout_rmse,
              .choice_rmse = after.holdout_rmse};
  if (!rest_is_noise) return trial;
  const Fitter whole = model_fit.over_whole_record();
  const auto first = std::count(record.training.begin(), record.training.end(), true);
  const auto sum = [&](const Fit& fit) {
    const std::vector<double> e = whole.innovations(fit);
    double squares = 0.0;
    for (auto i = static_cast<std::size_t>(first); i < e.size(); ++i) squares += e[i] * e[i];
    return squares * fit.noise_rms * fit.noise_rms;
  };
  Fit base = search.base;
  base.load = search.chosen.fit.load;
  trial.model_innovations = sum(base);
  trial.choice_innovations = sum(search.chosen.fit);
  return trial;
}

}  // namespace loopwarden::gap
