// SPDX-License-Identifier: Apache-2.0
// What the gap workflow found: everything that gap.json, the corrected model and the report show.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "model/plant/loop_model.hpp"

namespace loopwarden::gap {

inline constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

enum class Outcome : std::uint8_t { missing_effect, no_gap, unexplained };
const char* to_text(Outcome outcome) noexcept;

// Something about the record that a reader of the result must know.
struct RecordNote {
  std::string what;  // e.g. "frozen", "saturated", "missing", "little movement"
  std::string text;  // one sentence
  double from_s = kNone;
  double to_s = kNone;
};

// What the record itself says about its quality.
struct RecordCheck {
  bool usable = true;
  std::string refusal;            // why not, where not usable
  std::vector<RecordNote> notes;  // went on in spite of these
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
  double confidence = 0.0;                // 0 to 1, as in confidence.hpp
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

// What the chosen explanation leaves of PV, sample by sample.
struct Rest {
  bool is_noise = true;         // noise and a quiet load account for it
  double noise_ratio = kNone;   // its noise over the record's own; 1: all is explained
  double kurtosis = kNone;      // 3 for Gaussian noise
  double answer_to_co = kNone;  // F ratio of it regressed on past moves of CO
  double closed = kNone;        // share of the gap that is closed, first two thirds
  double quiet_rmse = kNone;    // PV units: of the free run's, by noise, load and a healthy valve
};

// What nothing can close, PV units. A load counts only as far as what is left on the last third
// passes for one: noise and a quiet load account for it, and it does not follow SP or CO
// (independence.hpp).
struct Floor {
  double transmitter_rmse = 0.0;  // noise and resolution, from PV itself
  double load_rmse = 0.0;
  bool load_tested = false;
  std::string why_not_tested{};  // a clause, where it was not

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

// What is left of the gap on the holdout, above the noise floor.
struct Remainder {
  double rmse = kNone;   // PV units
  double share = kNone;  // of the gap, 0 to 2; NaN: the gap is too near to the noise floor to say
  LooksLike looks_like = LooksLike::nothing_known;
  std::vector<std::string> depends_on{};  // "sp", "co": what it follows
};

struct Step {
  enum class Change : std::uint8_t { added, taken_out };
  std::string effect;
  Change change = Change::added;
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

// A competitor, fitted alone to what the model lacks.
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
  plant::LoopModel adjusted;    // the model, its process within its uncertainty where it fits best
  double holdout_from_s = 0.0;  // s
  Series series;
};

}  // namespace loopwarden::gap
