// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/classifier.hpp"

#include <algorithm>
#include <cmath>

#include "model/diagnosis/classifier_table.hpp"

namespace loopwarden::diagnosis {

const char* to_text(Cause cause) noexcept {
  switch (cause) {
    case Cause::none: return "none";
    case Cause::stiction: return "stiction";
    case Cause::backlash: return "backlash";
    case Cause::tuning: return "tuning";
    case Cause::disturbance: return "disturbance";
    case Cause::saturation: return "saturation";
    case Cause::sensor: return "sensor";
    case Cause::master_loop: return "master_loop";
    case Cause::no_flow: return "no_flow";
  }
  return "";
}

std::size_t leaf_of(const Tree& tree, const Features& features) {
  std::size_t node = 0;
  while (node < tree.threshold.size()) {
    const bool right = features[tree.feature[node]] > static_cast<double>(tree.threshold[node]);
    node = 2 * node + (right ? 2 : 1);
  }
  return node - tree.threshold.size();
}

CauseProbabilities weigh(const TreeTable& table, const Features& features) {
  CauseProbabilities p{};
  for (std::size_t c = 0; c < kCauseCount; ++c) p[c] = static_cast<double>(table.base[c]);
  for (std::size_t i = 0; i < table.trees.size(); ++i) {
    p[i % kCauseCount] +=
        static_cast<double>(table.trees[i].leaf[leaf_of(table.trees[i], features)]);
  }
  const double highest = *std::max_element(p.begin(), p.end());
  double sum = 0.0;
  for (double& v : p) sum += v = std::exp(v - highest);
  for (double& v : p) v /= sum;
  return p;
}

CauseProbabilities weigh(const Features& features) {
  return weigh({.base = kBaseScores, .trees = kTrees}, features);
}

}  // namespace loopwarden::diagnosis
