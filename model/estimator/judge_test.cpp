// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/judge_test.hpp"

#include <algorithm>

namespace loopwarden::estimator {
namespace {

using Names = std::vector<std::string>;

const Names kUnnamed{"unnamed"};

bool contains_all(const Names& names, const Names& part) {
  return std::all_of(part.begin(), part.end(), [&](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  });
}

// The explanation with most effects of which `names` has all; explanations.size(): none.
std::size_t explanation_of(const Names& names, const std::vector<Names>& explanations) {
  std::size_t best = explanations.size();
  for (std::size_t i = 0; i < explanations.size(); ++i) {
    const Names& e = explanations[i];
    if (e.empty() ? !names.empty() : !contains_all(names, e)) continue;
    if (best == explanations.size() || e.size() > explanations[best].size()) best = i;
  }
  return best;
}

}  // namespace

std::vector<double> among(const std::vector<double>& probability,
                          const std::vector<std::size_t>& index) {
  std::vector<double> out;
  double sum = 0.0;
  for (const std::size_t i : index) sum += out.emplace_back(probability[i]);
  for (double& p : out) p /= std::max(sum, 1e-300);
  return out;
}

Judged judge_test(const std::vector<Names>& explanations, const Observed& record,
                  const Observed& test, const plant::LoopModel& model, Options options,
                  const numeric::ParallelFor& parallel) {
  const Observed both =
      joined(record, test, kRest * std::max(plant::answer_s(model), model.sample_time_s));
  options.fitted = both.pv.size();
  const Estimate e = estimate(both, model, options, parallel);
  Judged out;
  out.probability.assign(explanations.size(), 0.0);
  out.explained = e.verdict != Verdict::unexplained;
  double all = 0.0;
  double highest = 0.0;
  for (const auto& [names, probability] : e.posterior) {
    if (names == kUnnamed) continue;
    all += probability;
    const std::size_t i = explanation_of(names, explanations);
    if (i < explanations.size()) {
      out.probability[i] += probability;
      continue;
    }
    out.other += probability;
    if (probability <= highest) continue;
    highest = probability;
    out.likeliest_other = names;
  }
  if (!(all > 0.0)) return out;
  out.other /= all;
  for (double& p : out.probability) p /= all;
  const auto top = std::max_element(out.probability.begin(), out.probability.end());
  if (out.explained && *top >= kDecides) {
    out.decided = static_cast<int>(top - out.probability.begin());
  }
  return out;
}

}  // namespace loopwarden::estimator
