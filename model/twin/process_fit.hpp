// SPDX-License-Identifier: Apache-2.0
// The process of a loop model as a record shows it: the posterior of the estimator's hypothesis
// `none`, with effects and disturbances of the model as they are.
//
//   gain, time constant, dead time, level   solved for at the present model, which moves to the
//                                           solution until it stays
//   covariance   of ln gain, ln time constant, ln dead time: the larger variance of two,
//                that of the posterior and  B/(B - 1) sum over B parts (v_b - mean)(v_b - mean)',
//                v_b = posterior covariance times the gradient of part b
//
// The second covariance stays right if neither model nor error is exactly the plant's.
// Errors: effects::EffectError for a model that can't be stepped.
// Source: White, Econometrica 50 (1982) 1-25.
#pragma once

#include <cstddef>
#include <vector>

#include "model/estimator/blocks.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::twin {

struct ProcessFit {
  plant::LoopModel model;
  plant::TwinFit posterior;     // parameters and covariance
  double log_likelihood = 0.0;  // nats
  std::vector<double> parts;    // of it, by part of the record
  std::vector<double> pv;       // free run of the whole record, PV units
  double training_rmse = 0.0;   // PV units, of the fitted samples
  double holdout_rmse = 0.0;    // PV units, of the others
};

// The part of a record that is fitted, with the noise of a sample in PV units.
struct FittedRecord {
  estimator::Observed observed;
  std::size_t fitted = 0;  // samples
  double noise_rms = 0.0;
  double level = 0.0;  // PV units, PV at CO 0 as stated; the fit stays near it
};

// A disturbance by which the level of PV may differ from the model's.
effects::EffectSpec any_level(const plant::LoopModel& model);

inline constexpr int kMostMoves = 5;  // of the model to its solution
ProcessFit fit_process(const FittedRecord& record, const plant::LoopModel& model,
                       int most_moves = kMostMoves);
// The model as it is: only its state at the first sample is solved for.
ProcessFit follow_process(const FittedRecord& record, const plant::LoopModel& model);

// A model whose process is hardly known: time constant and dead time are searched within a factor
// of four first.
plant::LoopModel find_process(const FittedRecord& record, const plant::LoopModel& model);

// The characteristic bent to the record: a table whose points are solved for, `fit` if that does not
// explain clearly more.
ProcessFit bend_characteristic(const FittedRecord& record, const ProcessFit& fit);
// Friction of a healthy valve, up to `most` CO units, that explains clearly more than none in most
// parts of the record; `fit` if there is none. `percent`: of the CO span, receives its size.
ProcessFit add_friction(const FittedRecord& record, const ProcessFit& fit, double most,
                        double& percent);

// Intensity of the random disturbance that explains the error of a free run beside the noise over
// the fitted part, PV units per root second: the Kalman filter of a random walk with the least
// prediction error.
double disturbance_of(const FittedRecord& record, const std::vector<double>& pv);

}  // namespace loopwarden::twin
