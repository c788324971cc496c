// SPDX-License-Identifier: Apache-2.0
// Searches for one effect among a few names, for the tests of single effects.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "model/gap/search.hpp"
#include "tests/model/gap/gap_support.hpp"

namespace loopwarden::test {

struct Named {
  std::string first;
  double lead_nats;  // over the next name
  plant::LoopModel corrected;
};

// Searches for a single effect among `names`, in 130 s of `truth` with SP steps.
inline Named named_among(const std::vector<std::string>& names, const plant::LoopModel& truth) {
  const numeric::LoopRecord record = record_of(truth, 130.0);
  const gap::FreeRun run(believed_model(), record.co);
  const gap::Fitter fitter(run, record.pv, std::vector<bool>(record.size(), true),
                           {.load = 0.3, .valve = 0.0}, true);
  std::vector<gap::Candidate> few;
  for (const gap::Candidate& c : candidates_for(believed_model(), record.co)) {
    if (std::find(names.begin(), names.end(), c.name) != names.end()) few.push_back(c);
  }
  const gap::SearchResult found =
      gap::search_effects(fitter, few, {}, {.several = false}, serial, [](double) {});
  const gap::Fit& best = found.singles.at(0).fit;
  return {best.terms[0]->name, found.singles.at(0).score - found.singles.at(1).score,
          run.corrected(best.terms, best.point, best.solved)};
}

}  // namespace loopwarden::test
