// SPDX-License-Identifier: Apache-2.0
// Result of the gap workflow: everything that gap.json, the corrected model and the report show.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "model/estimator/plan.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::gap {

inline constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

enum class Outcome : std::uint8_t { missing_effect, no_gap, unexplained };
const char* to_text(Outcome outcome) noexcept;

// A property of the record that a reader of the result must know.
struct RecordNote {
  std::string what;  // e.g. "frozen", "saturated", "missing", "little movement"
  std::string text;  // one sentence
  double from_s = kNone;
  double to_s = kNone;
};

// Quality of the record.
struct RecordCheck {
  bool usable = true;
  std::string refusal;            // reason, if not usable
  std::vector<RecordNote> notes;  // of a usable record
  double noise_rms = 0.0;         // PV units: white noise and rounding, from second differences
  double pv_resolution = 0.0;     // PV units, smallest step between neighbours; 0: not seen
  double co_resolution = 0.0;     // CO units
  int output_reversals = 0;       // of CO, beyond its noise
  double output_span_used = 0.0;  // CO units
};

// An effect that the model lacks.
struct FoundEffect {
  effects::EffectSpec spec;  // for controller_mismatch: kp, ki as found in the record
  effects::Block block = effects::Block::valve;
  double confidence = 0.0;                // 0 to 1: sum over the hypotheses with this name
  double lead_nats = kNone;               // over the best without it; NaN: controller
  std::vector<std::string> alternatives;  // names the record can't tell apart
  std::map<std::string, std::array<double, 2>> interval;  // 95 %, for each parameter
  std::string evidence;                                   // one sentence
};

// Of PV in a free run driven by the measured CO (without CO: of the closed loop driven by SP).
struct Misfit {
  double rmse = kNone;                 // PV units, whole record
  double fit_percent = kNone;          // NaN: PV hardly moves
  double training_rmse = kNone;        // PV units, first two thirds
  double holdout_rmse = kNone;         // PV units, last third
  double holdout_fit_percent = kNone;  // NaN: PV hardly moves
};

// One hypothesis: effects that the model lacks together.
struct Probability {
  std::vector<std::string> effects;  // empty: the model lacks none; "unnamed": no name fits
  double probability = 0.0;
};

// The remaining error on the first two thirds.
struct Rest {
  bool is_noise = true;       // noise and a small disturbance account for it
  double closed = kNone;      // share of the gap that is closed
  double quiet_rmse = kNone;  // PV units: error that noise, disturbance and a healthy valve leave
};

// Error that no model can close, PV units. The disturbance counts only as far as no law of CO
// explains it better.
struct Floor {
  double transmitter_rmse = 0.0;  // noise and resolution, from PV itself
  double load_rmse = 0.0;         // unmeasured disturbance
  bool load_tested = false;
  std::string why_not_tested{};  // a clause, if it was not tested

  double rmse() const noexcept { return std::hypot(transmitter_rmse, load_rmse); }
};

enum class LooksLike : std::uint8_t {
  disturbance,
  valve,
  process,
  controller,
  compression,
  nothing_known
};
const char* to_text(LooksLike what) noexcept;

// Remaining error on the last third, above the noise floor.
struct Remainder {
  double rmse = kNone;   // PV units
  double share = kNone;  // of the gap, 0 to 2; NaN: the gap is too near to the noise floor to say
  LooksLike looks_like = LooksLike::nothing_known;
  std::vector<std::string> depends_on{};  // "sp", "co": what it follows
};

struct Step {
  std::string effect;   // added
  double rmse = kNone;  // PV units, first two thirds
  double holdout_rmse = kNone;
};

enum class LocatedBy : std::uint8_t { block, time, condition };
const char* to_text(LocatedBy by) noexcept;

struct Located {
  LocatedBy by = LocatedBy::block;
  effects::Block block = effects::Block::valve;
  std::string what;
  double from_s = 0.0;  // where it shows most
  double to_s = 0.0;
  double share_of_gap = 0.0;  // adds up to 1 within each `by`
};

// An effect that was fitted without others.
struct TriedCandidate {
  std::string name;
  effects::Block block = effects::Block::valve;
  effects::EffectSpec spec;
  double rmse = kNone;  // PV units, first two thirds
  double score =
      kNone;  // log likelihood minus penalty, relative to the model as it is; more is better
  bool chosen = false;
  std::string why_not;
};

// The smallest move that tells the likeliest explanations apart (estimator/plan.hpp).
struct NextTest {
  std::vector<Probability> explanations;  // that it tells apart
  estimator::TestPlan plan;
  std::optional<estimator::TestPlan> next_class;  // a larger test that decides more often
};

// For pictures, one value a sample; NaN where there is none.
struct Series {
  std::vector<double> time_s, sp, pv, co;
  std::vector<double> stem;                 // CO units, as measured; empty: no read-back
  std::vector<double> pv_before, pv_after;  // free runs of the model as given and as corrected
  std::vector<double> co_before, co_after;  // the model's controller from the measured SP and PV
};

struct Result {
  Outcome outcome = Outcome::no_gap;
  std::string sentence;      // the whole result in one sentence
  bool closed_loop = false;  // compared as a closed loop, because CO was not measured
  RecordCheck check;
  std::vector<FoundEffect> effects;
  std::vector<Probability> posterior;  // likeliest first; the sum is 1
  Rest rest;
  Floor floor;
  double load_intensity = 0.0;  // PV units per root second, of the unmeasured load; 0: none seen
  Misfit before, after;
  std::optional<Remainder> remainder;     // none: nothing is left above the floor
  double controller_before_rmse = kNone;  // CO units
  double controller_after_rmse = kNone;
  std::vector<Step> steps;
  std::vector<Located> located;
  std::vector<TriedCandidate> candidates;
  plant::LoopModel model, corrected;
  plant::LoopModel adjusted;    // the model with its process moved within its uncertainty
  double holdout_from_s = 0.0;  // s
  Series series;
  std::optional<NextTest> next_test;
  std::string why_no_test;  // a sentence, if explanations compete and no test decides
};

}  // namespace loopwarden::gap
