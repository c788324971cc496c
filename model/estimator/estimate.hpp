// SPDX-License-Identifier: Apache-2.0
// One engine for a fit of a loop to a record: which effects does this model lack?
//
//   blocks, loop_run   the record and the free run of a hypothesis under the measured CO
//   likelihood         everything linear integrated out, with noise, disturbance and law error
//   population         the search of one hypothesis
//   competition        singles, pairs and triples
//   judgement          weights, intervals and absolute fit
//
// The first two thirds of the record are fitted; the last third proves. The same record and model
// give the same bits on any number of threads. docs/math/estimator.md explains the method.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "model/effects/effect_spec.hpp"
#include "model/estimator/blocks.hpp"
#include "model/estimator/constants.hpp"
#include "model/estimator/judgement.hpp"
#include "model/estimator/plan.hpp"
#include "model/estimator/since.hpp"
#include "model/numeric/parallel.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::estimator {

struct Options {
  std::vector<std::string> without{};  // names that are not given
  std::size_t most_effects = 3;
  bool level_known = true;  // false: PV at CO 0 is that of the record
  double largest_disturbance = kLimits.largest_disturbance;  // of the PV span per root second
  std::function<void(double)> progress{};                    // gets the share that is done
  std::size_t fitted = 0;                                    // samples; 0: two thirds of the record
  std::optional<Moments> since{};  // every effect acts from one of these moments on
};

enum class Verdict : std::uint8_t { no_gap, missing_effect, unexplained };
const char* to_text(Verdict verdict) noexcept;

struct Found {
  effects::EffectSpec spec;
  effects::Block block = effects::Block::valve;
  double confidence = 0.0;
  std::map<std::string, Interval> intervals;
  std::string description;  // of a law without a name
  Interval moment{};        // s, from which it acts, if not always
};

struct Errors {
  double training = 0.0;  // PV units, rms of the free run
  double holdout = 0.0;
};

// One hypothesis, for the report.
struct Ranked {
  std::string title;
  bool named = true;  // by the catalogue
  std::vector<effects::EffectSpec> effects{};
  std::vector<effects::Block> blocks{};  // of the effects
  double score = 0.0;                    // nats
  double log_likelihood = 0.0;           // nats
  double weight = 0.0;
  Errors left{};
  ErrorSize error{};
  std::string parameters{};
};

// Explanations after a record and a later one.
struct Reweighted {
  std::vector<double> score;        // nats
  std::vector<double> probability;  // among the explanations; the sum is 1
};

struct Estimate {
  Verdict verdict = Verdict::no_gap;
  std::vector<Found> effects;
  std::vector<Found> nearest;  // of the chosen hypothesis, if it does not explain the record
  // Hypotheses by probability; {"unnamed"}: none of the catalogue. The sum is 1.
  std::vector<std::pair<std::vector<std::string>, double>> posterior;
  std::vector<Ranked> ranked;
  // Those of the catalogue with at least kCompetes of its probability, as models of the loop.
  std::vector<Explanation> explanations;
  // The explanations after a later record, by their members, without a new search. A search would
  // find what made a simulated record, so its sample is tried, too.
  std::function<Reweighted(const Observed& later, double rest_s, std::optional<Drawn> from)>
      reweighted;
  Errors before, after;
  double with_slips = 0.0;  // PV units, last third, with the slips that PV shows there
  double noise_rms = 0.0;   // PV units
  double floor = 0.0;       // PV units: noise and disturbance
  double law_error = 0.0;   // PV units: of the law itself
  double closed = 0.0;      // share of the gap, last third
  std::string chosen;       // hypothesis that was tested against the floor
  Errors chosen_left;
  // A law without a name, added to the chosen hypothesis.
  std::string flexible;
  double flexible_lead = 0.0;  // nats
  Errors with_flexible;
  std::size_t evaluations = 0;
  std::vector<double> pv_before, pv_after;  // PV units
  plant::LoopModel corrected;
  plant::LoopModel adjusted;  // without an effect, within the uncertainty of the model
};

// `model`: at the period of the record.
Estimate estimate(const Observed& observed, const plant::LoopModel& model, const Options& options,
                  const numeric::ParallelFor& parallel);

}  // namespace loopwarden::estimator
