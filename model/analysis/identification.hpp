// SPDX-License-Identifier: Apache-2.0
// Identifies a process model (gain, lags, dead time) from a record of CO and PV in open or closed
// loop.
//
// Four forms are fitted, each together with a noise model (prediction_error.hpp): one lag, two
// lags, integrating, integrating with a lag. The preferred form has the least Bayesian information
// criterion.
//
// The loop is closed if the mode of the record is automatic or if CO follows from PV
// (excitation.hpp). In closed loop only external moves, those of SP and manual moves of CO,
// distinguish the process from a disturbance. The result has no model, but a reason and a remedy,
// in two cases:
//   - These moves (in open loop: all of CO) would not fix the gain within 20 % (95 %).
//   - The interval of the gain reaches further than a factor of two.
// Wider intervals contain the true value less often than their 95 % (lab/identify_study).
//
// A model is rejected if its free run has a larger error than a straight line through PV. In open
// loop the forms are then fitted again without a noise model, because an exact log makes the errors
// of the noise model large. Their intervals are widened by the correlation of the errors. If these
// fits are no better, the result has no model. In open loop CO may be logged up to three samples
// too late. It is shifted back if PV then fits far better. Lags of about a sampling period have
// wide intervals, because the record has no information about CO between two samples. A gain that
// depends on the opening is reported from the samples at which PV rests (static_gain()).
//
// Records of more than 20 000 samples are thinned by means if the process is slow compared with the
// sampling. Then they are cut to the stretch in which SP (in open loop CO) moves most. `notes`
// reports both.
//
// If there is no model, the record is tried as the limit cycle of a sticking valve
// (sticking_cycle.hpp), which needs neither external moves nor SP.
//
// Errors: IdentificationError if the record has too few samples, or if PV or CO never moves.
// Limits: in other records, friction or backlash of the valve makes the gain too small and the dead
// time too long (figures are in lab/identify_study). The intervals assume that the form is right
// and that the disturbance is noise through a linear filter.
//
// Sources: Ljung, System Identification (1999), ch. 13 (closed loop). Tangent: Ziegler and Nichols
// (1942); Sewdass, thesis, figure 6.4.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "model/analysis/prediction_error.hpp"
#include "model/analysis/sticking_cycle.hpp"
#include "model/numeric/loop_record.hpp"
#include "model/plant/loop_model.hpp"
#include "model/plant/process.hpp"

namespace loopwarden::analysis {

// Error for a record that can't be analysed.
class IdentificationError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The fit of one form.
struct ProcessFit {
  ProcessForm form = ProcessForm::one_lag;
  Estimate gain;             // PV units / CO unit; integrating: PV units / (CO unit s)
  Estimate time_constant_s;  // T1; unused if integrating
  Estimate second_lag_s;     // T2; 0: no second lag
  Estimate dead_time_s;      // L
  std::size_t noise_order = 0;
  double rest_pv = 0.0;          // PV units, at the first CO
  std::optional<double> level;   // PV units, at CO 0; empty if integrating
  double prediction_rms = 0.0;   // PV units, error of the prediction one sample ahead
  double rmse = 0.0;             // PV units, error of the free run of the process
  double fit_percent = 0.0;      // of the free run: 100 (1 - rmse / standard deviation of PV)
  double criterion = 0.0;        // Bayesian information criterion; the smaller the better
  std::vector<double> free_run;  // PV units, at the samples used

  plant::ProcessParameters process() const;
};

// The fitted samples: `count` means of `thinned` samples each, starting at sample `from` of the
// record.
struct SamplesUsed {
  std::size_t from = 0;
  std::size_t thinned = 1;
  std::size_t count = 0;
};

// The result of identify().
struct Identification {
  bool closed_loop = false;
  bool by_mode = false;  // `closed_loop` follows from the mode column
  SamplesUsed used;
  std::size_t late = 0;          // samples by which CO was logged too late and is shifted back
  std::vector<ProcessFit> fits;  // with intervals; empty if there is no model
  std::size_t preferred = 0;     // index in `fits`
  std::string reason;            // why there is no model, a sentence; empty if there is one
  std::string settle;            // remedy
  std::vector<std::string> notes;
  // The valve of a limit cycle. `fits` then has only the process, if its gain can be determined.
  std::optional<StickingCycle> cycle;
  // Relative uncertainty of the gain from the external moves only, 95 %.
  double outside_margin = 0.0;

  bool can_tell() const noexcept { return reason.empty(); }
  const ProcessFit& best() const { return fits[preferred]; }  // only if can_tell()
};

// Identifies the process. Throws IdentificationError.
Identification identify(const numeric::LoopView& record);

// The gain at both ends of the travel of CO in the record, from the samples at which CO and PV
// rest. It is empty if there are too few rests or if one gain fits all of them.
struct StaticGain {
  double low_co = 0.0, high_co = 0.0;  // CO units, least and greatest
  double at_low = 0.0, at_high = 0.0;  // PV units/CO unit there
};
std::optional<StaticGain> static_gain(std::span<const double> co, std::span<const double> pv);

// The known lower and upper ends of the ranges, PV units and CO units.
struct KnownRanges {
  std::optional<std::pair<double, double>> pv{}, co{};
};

// A loop model from a record only: the identified process, and the controller by which CO follows
// SP and PV. SP is a constant if it isn't in the record. Ranges are the known ones, otherwise from
// the measured values. `assumptions` has one sentence per assumption. With a sticking valve the
// gain can be as uncertain as the cycle leaves it. `model` is empty if the process can't be
// identified.
struct AssumedModel {
  std::optional<plant::LoopModel> model;
  Identification identification;
  std::vector<std::string> assumptions;
  bool controller_known =
      false;  // false: a proportional controller replaces it, and only the measured CO counts
};
// Returns the model. Throws IdentificationError.
AssumedModel assumed_model(const numeric::LoopView& record, const KnownRanges& known = {});
// Returns the range of a signal from its measured values: 0 to 100 or 0 to 10 if it fits, otherwise
// the measured range plus a tenth on either side.
std::pair<double, double> assumed_range(std::span<const double> column);
// Returns the model of a valve without process: the stem follows CO, both in CO units. `co` has the
// known values of CO.
plant::LoopModel stem_follows_output(std::span<const double> co, double sample_time_s);

// The tangent at the steepest point of PV after one step of CO. Its slope is that of a line through
// at least three samples, over a tenth of the time from 20 to 85 % of the response.
//   L  time from the step to the point at which the tangent meets the value before
//   T  time from that point to the point at which the tangent meets the final value
struct Tangent {
  plant::ProcessParameters process;
  double step_time_s = 0.0;  // time of the step of CO
  double steepest_s = 0.0;   // time at which the tangent touches PV
  double slope = 0.0;        // PV units / s
  double before = 0.0;       // PV units
  double final_value = 0.0;  // PV units
};
// Returns the tangent. Throws IdentificationError.
Tangent tangent_method(std::span<const double> co, std::span<const double> pv,
                       double sample_time_s);

}  // namespace loopwarden::analysis
