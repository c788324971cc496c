// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/posterior_bars.hpp"

#include <algorithm>

#include "base/text.hpp"

namespace loopwarden::workbench {

std::vector<Bar> posterior_bars(const std::vector<gap::Probability>& posterior, std::size_t most) {
  std::vector<Bar> bars;
  Bar others{"others", 0.0, false};
  Bar none{"none of these", 0.0, false};
  for (const gap::Probability& h : posterior) {
    if (h.effects.size() == 1 && h.effects.front() == "unnamed") {
      none.probability = h.probability;
    } else if (bars.size() < most) {
      bars.push_back({title_of(h.effects), h.probability, !h.effects.empty()});
    } else {
      others.probability += h.probability;
    }
  }
  if (posterior.empty()) return bars;
  if (others.probability > 0.0) bars.push_back(others);
  bars.push_back(none);
  return bars;
}

}  // namespace loopwarden::workbench
