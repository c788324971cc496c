// SPDX-License-Identifier: Apache-2.0
// A process model from a record of CO and PV, in open or in closed loop: gain, lags, dead time.
//
// Four forms are fitted, each beside a noise model (prediction_error.hpp): one lag, two lags, integrating,
// integrating with a lag. The preferred one has the least Bayesian information criterion.
//
// In closed loop (the record's mode, or a CO that follows from PV, excitation.hpp) only what comes from outside
// tells the process from the load: moves of SP, of CO by hand. If that alone (in open loop: all of CO) would
// not fix the gain within 20 % (95 %), or the interval found reaches further than a factor of two, there is no
// number, but the reason and what would help: beyond, intervals hold the truth less often than they say
// (studies/identify).
//
// A model whose free run leaves more than a straight line through PV is no model: then in open loop
// the forms are fitted again without a noise model (whose errors an exact log makes large), their
// intervals widened by how its errors hang together; if these are no better, there is no number. In
// open loop CO may be logged up to three samples too late: it is taken back if PV fits far better
// so. Lags of about a sampling period have wide intervals, as what CO does between two samples is
// not in the record. A gain that depends on the opening is reported from where PV rests
// (static_gain()).
//
// Records of more than 20 000 samples are thinned by means where the process is slow against the
// sampling, then cut to the stretch where SP (in open loop CO) moves most; `notes` says so.
//
// Errors: IdentificationError where the record holds nothing to look at: too few samples, PV or CO that never
// moves.
// Where that leaves no number, the record is tried as the limit cycle of a sticking valve (sticking_cycle.hpp), which
// needs nothing from outside, nor SP.
//
// Limits: valves with friction or play in other records: gain too small, dead time too long (studies/identify
// has figures). Intervals assume that the form is right and that the load is noise through a linear filter.
//
// Sources: Ljung, System Identification (1999), ch. 13 (closed loop).
// Tangent: Ziegler and Nichols (1942); Sewdass, thesis, figure 6.4.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "model/analysis/prediction_error.hpp"
#include "model/analysis/sticking_cycle.hpp"
#include "model/plant/loop_model.hpp"
#include "model/plant/process.hpp"

namespace loopwarden::analysis {

class IdentificationError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct ProcessFit {
  ProcessForm form = ProcessForm::one_lag;
  Estimate gain;             // PV units / CO unit; integrating: PV units / (CO unit s)
  Estimate time_constant_s;  // T1; integrating: none
  Estimate second_lag_s;     // T2; 0: none
  Estimate dead_time_s;      // L
  std::size_t noise_order = 0;
  double rest_pv = 0.0;          // PV units, at the first CO
  std::optional<double> level;   // PV units, at CO 0; integrating: none
  double prediction_rms = 0.0;   // PV units, of what could not be predicted one sample ahead
  double rmse = 0.0;             // PV units, of the free run of the process alone
  double fit_percent = 0.0;      // of the free run: 100 (1 - rmse / standard deviation of PV)
  double criterion = 0.0;        // Bayesian information criterion; the smaller the better
  std::vector<double> free_run;  // PV units, on the samples used

  plant::ProcessParameters process() const;
};

// Columns of one length; NaN where missing. `sp`, `mode` and `stem` may be empty.
struct IdentificationRecord {
  std::span<const double> co, pv, sp;
  std::span<const double> mode{};  // 0 by hand, else automatic
  std::span<const double> stem{};  // CO units, the positioner's read-back
  double sample_time_s = 0.1;
};

// The samples that were fitted: `count` of them, each the mean of `thinned`, from sample `from` of the record on.
struct SamplesUsed {
  std::size_t from = 0;
  std::size_t thinned = 1;
  std::size_t count = 0;
};

struct Identification {
  bool closed_loop = false;
  bool by_mode = false;  // the mode column says that it is closed
  SamplesUsed used;
  std::size_t late = 0;          // samples, of CO in the log; it was taken back by as much
  std::vector<ProcessFit> fits;  // with intervals; none where the record can't tell
  std::size_t preferred = 0;     // of `fits`
  std::string reason;            // why it can't tell, a sentence; empty where it can
  std::string settle;            // what would help
  std::vector<std::string> notes;
  // The valve of a limit cycle; `fits` then holds the process behind it alone, if its gain can be told.
  std::optional<StickingCycle> cycle;
  // What of the gain the outside moves alone would leave open, relative, 95 %.
  double outside_margin = 0.0;

  bool can_tell() const noexcept { return reason.empty(); }
  const ProcessFit& best() const { return fits[preferred]; }  // only where can_tell()
};

Identification identify(const IdentificationRecord& record);

// The gain at both ends of CO's travel in the record, from the places where CO and PV rest. Nothing
// if there are too few or if one gain explains them.
struct StaticGain {
  double low_co = 0.0, high_co = 0.0;  // CO units, least and greatest
  double at_low = 0.0, at_high = 0.0;  // PV units/CO unit there
};
std::optional<StaticGain> static_gain(std::span<const double> co, std::span<const double> pv);

// Lower and upper end, PV units and CO units, where they are known.
struct KnownRanges {
  std::optional<std::pair<double, double>> pv{}, co{};
};

// A loop model that a record alone suggests: the identified process, the controller as CO follows from SP and PV (SP a
// constant where it is not in the record), ranges as known, else from what was measured. What was assumed stands in `assumptions`, one
// sentence each. Behind a valve that sticks the process may have a gain as uncertain as the cycle leaves it. Nothing
// where the process can't be told.
struct AssumedModel {
  std::optional<plant::LoopModel> model;
  Identification identification;
  std::vector<std::string> assumptions;
  bool controller_known =
      false;  // else a proportional one stands in its place, and only the measured CO counts
};
AssumedModel assumed_model(const IdentificationRecord& record, const KnownRanges& known = {});
// The range of a signal by what was measured: 0 to 100 or 0 to 10 where that fits, else a tenth more on either side.
std::pair<double, double> assumed_range(std::span<const double> column);
// A valve alone: its stem follows CO, both in CO units. `co` has a value where CO is known.
plant::LoopModel stem_follows_output(std::span<const double> co, double sample_time_s);

// The tangent at the steepest point of PV after one step of CO. The slope is that of a line through the
// samples of a tenth of the time from 20 to 85 % of the answer, at least three.
//   L  from the step to where the tangent meets the value before
//   T  from there to where it meets the final value
struct Tangent {
  plant::ProcessParameters process;
  double step_time_s = 0.0;  // when CO moved
  double steepest_s = 0.0;   // where the tangent touches
  double slope = 0.0;        // PV units / s
  double before = 0.0;       // PV units
  double final_value = 0.0;  // PV units
};
Tangent tangent_method(std::span<const double> co, std::span<const double> pv,
                       double sample_time_s);

}  // namespace loopwarden::analysis
