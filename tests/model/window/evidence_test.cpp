// SPDX-License-Identifier: Apache-2.0
#include "model/window/evidence.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "model/training/team_training.hpp"
#include "tests/model/specialist/specialist_support.hpp"

namespace evidence_test {

using namespace loopwarden;
using namespace loopwarden::specialist;

TEST_CASE("no input of the networks is dead", "[specialist]") {
  const std::vector<Example> examples =
      simulate_examples(tests::flow_loop(), 64, 11, tests::one_thread());
  for (std::size_t i = 0; i < kEvidence; ++i) {
    double low = examples.front().evidence[i];
    double high = low;
    for (const Example& e : examples) {
      CHECK(std::isfinite(e.evidence[i]));
      low = std::min(low, e.evidence[i]);
      high = std::max(high, e.evidence[i]);
    }
    INFO(kEvidenceNames[i] << ": " << low << " to " << high);
    CHECK(high - low > 0.1);
  }
}

TEST_CASE("evidence is found by its name", "[specialist]") {
  CHECK(std::set(kEvidenceNames.begin(), kEvidenceNames.end()).size() == kEvidence);
  Explanations f;
  f.noise = 0.1;
  f.co_range = 10.0;
  f.pv_range = 8.0;
  f.reversals = 6.0;
  for (ExplanationFit& fit : f.fits) {
    fit.mse = 0.02;
    fit.innovation = 0.02;
    fit.shape = 1.0;
  }
  ExplanationFit& stiction = f.fits[static_cast<std::size_t>(Explanation::stiction)];
  stiction.mse = 0.01;
  stiction.shape = 0.25;
  const Evidence evidence = evidence_of(f);
  CHECK(evidence[evidence_index("stiction_misfit")] == Approx(0.0).margin(1e-6));
  CHECK(evidence[evidence_index("backlash_misfit")] == Approx(std::log(2.0)));
  CHECK(evidence[evidence_index("stiction_over_backlash")] == Approx(-2.0 * std::log(2.0)));
  CHECK(evidence[evidence_index("stiction_jump")] == Approx(1.0));
  CHECK(evidence[evidence_index("co_range_over_noise")] == Approx(std::log(100.0)));
  CHECK(evidence[evidence_index("co_reversals")] == Approx(std::log(7.0)));
}

}  // namespace evidence_test
