// SPDX-License-Identifier: Apache-2.0
#include "model/gap/say.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

namespace say_test {

using namespace loopwarden::gap;
using Catch::Matchers::Contains;

namespace {

std::vector<FoundEffect> gain_change() {
  FoundEffect effect;
  effect.spec = {"gain_change", {{"factor", 1.36}}};
  return {effect};
}
const Misfit kBefore{.rmse = 1.33, .holdout_rmse = 1.4};
const Misfit kAfter{.rmse = 0.2, .holdout_rmse = 0.28};

std::string said(Outcome outcome, const std::optional<Remainder>& remainder,
                 const std::vector<std::string>& best = {}) {
  const std::vector<FoundEffect> effects =
      outcome == Outcome::missing_effect ? gain_change() : std::vector<FoundEffect>{};
  return sentence_of({.outcome = outcome,
                      .effects = effects,
                      .before = kBefore,
                      .after = kAfter,
                      .floor = 0.02,
                      .remainder = remainder,
                      .best = best});
}

}  // namespace

TEST_CASE("a named controller with an unexplained plant reports both", "[gap][say]") {
  FoundEffect controller;
  controller.spec = {"controller_mismatch", {{"kp", 1.9}, {"ki", 0.18}}};
  const std::vector<FoundEffect> effects{controller};
  const std::string text = sentence_of({.outcome = Outcome::missing_effect,
                                        .effects = effects,
                                        .before = kBefore,
                                        .after = kBefore,
                                        .remainder = std::nullopt,
                                        .best = {},
                                        .plant_unexplained = true});
  CHECK(text ==
        "The model lacks controller_mismatch (ki 0.18 CO units/(PV unit s), kp 1.9 CO units/PV "
        "unit). From CO to PV, model and record differ by 1.33 rms. No effect of the catalogue "
        "explains this.");
}

TEST_CASE("the closed share is of RMS values, above the noise floor", "[gap][say]") {
  CHECK(rms_closed(1.4, 0.28, 0.02) == Approx((1.4 - 0.28) / (1.4 - 0.02)));
  CHECK(rms_closed(1.0, 0.01, 0.1) == 1.0);
  CHECK(rms_closed(1.0, 30.0, 0.1) == -1.0);
  CHECK(std::isnan(rms_closed(0.1, 0.1, 0.1)));
  const std::string sentence =
      said(Outcome::missing_effect, Remainder{0.28, 0.04, LooksLike::disturbance});
  CHECK_THAT(sentence, Contains("gain_change (factor 1.36)"));
  CHECK_THAT(sentence, Contains("closes 81 % of the RMS error above the noise floor."));
  // An error of a percent is not worth a sentence, and an error that can't be measured has none.
  for (const double share : {0.019, kNone}) {
    CHECK_THAT(said(Outcome::missing_effect, Remainder{0.28, share, LooksLike::valve}),
               !Contains("RMS error above"));
  }
}

TEST_CASE("an unexplained gap names the best candidate, and what the error looks like",
          "[gap][say]") {
  const std::string sentence =
      said(Outcome::unexplained, Remainder{1.4, 1.0, LooksLike::valve}, {"stiction", "drift"});
  CHECK_THAT(sentence, Contains("stiction and drift, does not hold on unseen data"));
  CHECK_THAT(sentence, Contains("The error looks like the valve."));
  CHECK_THAT(said(Outcome::unexplained, Remainder{1.4, 1.0, LooksLike::nothing_known}),
             !Contains("candidate") && !Contains("looks like"));
}

}  // namespace say_test
