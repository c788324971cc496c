// SPDX-License-Identifier: Apache-2.0
#include "model/gap/say.hpp"

#include <catch2/catch.hpp>
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
                 const std::vector<std::string>& best = {}, double best_closed = kNone) {
  const std::vector<FoundEffect> effects =
      outcome == Outcome::missing_effect ? gain_change() : std::vector<FoundEffect>{};
  return sentence_of({.outcome = outcome,
                      .effects = effects,
                      .before = kBefore,
                      .after = kAfter,
                      .remainder = remainder,
                      .best = best,
                      .best_closed = best_closed});
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
        "The model lacks controller_mismatch (ki 0.18, kp 1.9), as CO shows. From CO to PV, model "
        "and record differ by 1.33 rms. No effect of the catalogue explains this.");
}

TEST_CASE("a partial answer reports how much it explains, and what the remaining error looks like",
          "[gap][say]") {
  const std::string sentence =
      said(Outcome::missing_effect, Remainder{0.28, 0.04, LooksLike::disturbance});
  CHECK_THAT(sentence, Contains("gain_change (factor 1.36)"));
  CHECK_THAT(sentence,
             Contains("(96 % of the gap). The remaining error looks like a disturbance."));
  CHECK_THAT(said(Outcome::missing_effect, Remainder{0.28, 0.03, LooksLike::disturbance}),
             Contains("(97 % of the gap)"));
  // An error of a percent is not worth a sentence, and an error that can't be measured has no
  // sentence.
  CHECK_THAT(said(Outcome::missing_effect, Remainder{0.28, 0.019, LooksLike::valve}),
             !Contains("% of the gap"));
  CHECK_THAT(said(Outcome::missing_effect, Remainder{0.28, kNone, LooksLike::valve}),
             !Contains("% of the gap"));
}

TEST_CASE("an unexplained gap names the best attempt, and what the error looks like",
          "[gap][say]") {
  const std::string sentence = said(Outcome::unexplained, Remainder{1.4, 1.0, LooksLike::valve},
                                    {"stiction", "drift"}, 0.42);
  CHECK_THAT(sentence, Contains("stiction and drift, closes only 42 %"));
  CHECK_THAT(sentence, Contains("The error looks like the valve."));
  CHECK_THAT(
      said(Outcome::unexplained, Remainder{1.4, 1.0, LooksLike::nothing_known}, {"drift"}, -0.5),
      !Contains("drift") && !Contains("looks like"));
}

}  // namespace say_test
