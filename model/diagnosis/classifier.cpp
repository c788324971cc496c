// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/classifier.hpp"

#include <algorithm>
#include <cmath>

#include "model/numeric/enum_name.hpp"

namespace loopwarden::diagnosis {

const char* to_text(Cause cause) noexcept {
  return numeric::enum_name<Cause::neighbour>(
      cause, {"none", "stiction", "backlash", "tuning", "disturbance", "saturation", "sensor",
              "master_loop", "no_flow", "neighbour"});
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

CauseProbabilities weigh(const Features& features) { return weigh(kTreeTable, features); }

}  // namespace loopwarden::diagnosis
