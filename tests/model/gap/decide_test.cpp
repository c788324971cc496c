// SPDX-License-Identifier: Apache-2.0
#include "model/gap/decide.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <string>
#include <vector>

namespace decide_test {

using namespace loopwarden::gap;

namespace {

constexpr std::array kNoise{ConfidenceRow{0.0, 8, 3}, ConfidenceRow{12.0, 18, 15},
                            ConfidenceRow{40.0, 98, 98}};
constexpr std::array kMore{ConfidenceRow{0.0, 18, 9}};
const ConfidenceTable kTable{kNoise, kMore, {0.0, 38, 38}};
constexpr Scale kScale{.noise_rms = 0.01, .least_rms = 0.015};

// One clear name, with an error of noise only.
Competition one_name() {
  return {{{"stiction"}, 100.0, 0.01}, {{{"backlash"}, 50.0}, {{"stiction"}, 100.0}}, 0.5};
}
Residuals noise() { return {.noise_ratio = 1.0, .quiet_rmse = 0.01, .closed = 1.0}; }
Residuals more_than_noise() {
  return {.noise_ratio = 3.0,
          .quiet_rmse = 0.01,
          .closed = 0.5,
          .adequate = false,
          .believable = false};
}

Decision decided(const Competition& competition, const Residuals& left,
                 const ControllerFinding& controller = {}) {
  return decide(competition, left, controller, kScale, kTable);
}

}  // namespace

TEST_CASE("a name over noise is given with the confidence of its lead", "[gap][decide]") {
  const Decision d = decided(one_name(), noise());
  REQUIRE(d.named.size() == 1);
  CHECK(d.named[0].name == "stiction");
  CHECK(d.named[0].lead_nats == 50.0);
  CHECK(d.named[0].confidence == Approx(0.99));
  CHECK(d.named[0].alternatives.empty());
  CHECK(outcome_of(d, Proof::holds) == Outcome::missing_effect);
}

TEST_CASE("each of a pair has a separate lead and confidence", "[gap][decide]") {
  const Competition pair{{{"stiction", "gain_change"}, 200.0},
                         {{{"stiction"}, 185.0}, {{"gain_change", "backlash"}, 100.0}},
                         0.5};
  const Decision d = decided(pair, noise());
  REQUIRE(d.named.size() == 2);
  CHECK(d.named[0].lead_nats == 100.0);
  CHECK(d.named[0].confidence == Approx(0.99));
  CHECK(d.named[1].name == "gain_change");
  CHECK(d.named[1].lead_nats == 15.0);
  CHECK(d.named[1].confidence == Approx(0.8));
}

TEST_CASE("names within six nats of the first are alternatives", "[gap][decide]") {
  Competition near = one_name();
  near.tried[0].score = 94.01;
  CHECK(decided(near, noise()).named[0].alternatives == std::vector<std::string>{"backlash"});
  near.tried[0].score = 93.99;
  CHECK(decided(near, noise()).named[0].alternatives.empty());
  // For a pair, only the names that replace this name, each once.
  const Competition pair{{{"stiction", "drift"}, 100.0},
                         {{{"backlash", "drift"}, 97.0},
                          {{"backlash", "extra_lag"}, 96.0},
                          {{"hysteresis"}, 99.0},
                          {{"stiction", "output_bias"}, 98.0}},
                         0.5};
  const Decision d = decided(pair, noise());
  CHECK(d.named[0].alternatives == std::vector<std::string>{"backlash", "extra_lag"});
  CHECK(d.named[1].alternatives ==
        std::vector<std::string>{"backlash", "extra_lag", "output_bias"});
}

TEST_CASE("an effect that closes no gap is no rival, however likely", "[gap][decide]") {
  Competition load = one_name();
  load.tried.push_back({{"step_disturbance"}, 120.0, 0.4999});
  const Decision d = decided(load, noise());
  CHECK(d.named[0].lead_nats == 50.0);
  CHECK(d.named[0].alternatives.empty());
  load.tried.back().training_rmse = 0.45;
  CHECK(decided(load, noise()).named[0].lead_nats == -20.0);
  CHECK(decided(load, noise()).named[0].alternatives ==
        std::vector<std::string>{"step_disturbance"});
}

TEST_CASE("a finding of the reading itself is kept, whatever the fit", "[gap][decide]") {
  Decision d = decided(one_name(), more_than_noise());
  d.by_reading = true;
  CHECK(outcome_of(d, Proof::refuted) == Outcome::missing_effect);
  d.named.clear();
  CHECK(outcome_of(d, Proof::holds) == Outcome::missing_effect);
}

TEST_CASE("a remaining error above noise needs the proof of the holdout", "[gap][decide]") {
  const Decision d = decided(one_name(), more_than_noise());
  CHECK_FALSE(d.believable);
  CHECK(d.unexplained);
  CHECK(outcome_of(d, Proof::refuted) == Outcome::unexplained);
  // Unless the names hold on data that the fit did not use.
  CHECK(outcome_of(d, Proof::holds) == Outcome::missing_effect);
  CHECK(outcome_of(d, Proof::partly) == Outcome::missing_effect);

  // A name that closes enough on the data of the fit is believable. It gets the usual confidence of
  // such names.
  Residuals mostly = more_than_noise();
  mostly.believable = true;
  const Decision named = decided(one_name(), mostly);
  REQUIRE(named.named.size() == 1);
  CHECK(named.named[0].confidence == Approx(0.5));
  CHECK(outcome_of(named, Proof::holds) == Outcome::missing_effect);
}

TEST_CASE("a remaining error above noise is no gap if it does not matter", "[gap][decide]") {
  Competition none{{{}, 0.0, 0.018}, {}, 0.018};
  // sqrt(0.01^2 + 0.015^2) = 0.01803
  CHECK_FALSE(decided(none, more_than_noise()).unexplained);
  CHECK(outcome_of(decided(none, more_than_noise()), Proof::holds) == Outcome::no_gap);
  none.model_rmse = 0.01802;
  CHECK_FALSE(decided(none, more_than_noise()).unexplained);
  none.model_rmse = 0.01804;
  CHECK(decided(none, more_than_noise()).unexplained);
}

TEST_CASE("noise and a quiet load are no gap, whatever their size", "[gap][decide]") {
  const Competition none{{{}, 0.0, 0.4}, {{{"drift"}, 3.0}}, 0.4};
  const Decision d = decided(none, noise());
  CHECK(d.named.empty());
  CHECK(outcome_of(d, Proof::holds) == Outcome::no_gap);
}

TEST_CASE("a controller needs no other evidence", "[gap][decide]") {
  const Competition none{{{}, 0.0, 0.01}, {}, 0.01};
  ControllerFinding other;
  other.compared = true;
  other.mismatch = true;
  CHECK(outcome_of(decided(none, noise(), other), Proof::holds) == Outcome::missing_effect);
  other.mismatch = false;
  other.unexplained = true;
  CHECK(outcome_of(decided(none, noise(), other), Proof::holds) == Outcome::unexplained);
}

TEST_CASE("settings that reproduce CO to the last step are named, whatever the plant lacks",
          "[gap][decide]") {
  const Competition none{{{}, 0.0, 0.4}, {}, 0.4};
  ControllerFinding other;
  other.compared = true;
  other.mismatch = true;
  CHECK(outcome_of(decided(none, more_than_noise(), other), Proof::holds) == Outcome::unexplained);
  other.exact = true;
  CHECK(outcome_of(decided(none, more_than_noise(), other), Proof::holds) ==
        Outcome::missing_effect);
}

TEST_CASE("other settings of the controller close no gap of the plant", "[gap][decide]") {
  ControllerFinding other;
  other.compared = true;
  other.mismatch = true;
  const Decision named = decided(one_name(), noise(), other);
  CHECK(outcome_of(named, Proof::holds) == Outcome::missing_effect);
  CHECK(outcome_of(named, Proof::refuted) == Outcome::unexplained);
  const Competition none{{{}, 0.0, 0.5}, {}, 0.5};
  CHECK(outcome_of(decided(none, more_than_noise(), other), Proof::holds) == Outcome::unexplained);
}

TEST_CASE("a name that only partly holds is never sure", "[gap][decide]") {
  CHECK(confidence_after(0.97, Proof::holds) == 0.97);
  CHECK(confidence_after(0.97, Proof::partly) == 0.89);
  CHECK(confidence_after(0.6, Proof::partly) == 0.6);
}

TEST_CASE("a name that the holdout refutes is unexplained", "[gap][decide]") {
  CHECK(outcome_of(decided(one_name(), noise()), Proof::refuted) == Outcome::unexplained);
}

}  // namespace decide_test
