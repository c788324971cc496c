// SPDX-License-Identifier: Apache-2.0
// The loop of the thesis's plant 1 as assumed by the study of its five measured records: published,
// corrected, and with one added effect.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "model/plant/loop_model.hpp"
#include "lab/plant1/shared_fit.hpp"

namespace loopwarden::lab {

inline constexpr double kPlant1PeriodS = 0.1;  // of its records

struct Plant1Record {
  std::string name;        // P1N22
  std::string condition;   // no_fault, or the added effect
  std::vector<double> pv;  // L/min, at 10 Hz
  double rest = 0.0;       // L/min, reading with the valve closed: mean before the flow begins
  double noise = 0.0;      // L/min, standard deviation there
  double variance = 0.0;   // (L/min)^2, of the whole record
};

// `pv`: at least 100 samples without gaps, the first 20 at rest.
Plant1Record plant1_record(std::string name, std::string condition, std::vector<double> pv);

// One effect of the catalogue to be added to the plant.
struct Plant1Candidate {
  std::string name;   // name in the catalogue; "none" for no effect
  std::string label;  // name with its variant
  std::vector<FitBound> bounds;
  std::function<void(std::span<const double> parameters, plant::LoopModel&)> add;
};

// Returns all candidates, "none" first. Valve effects are placed before the positioner, as the
// software blocks of the thesis.
const std::vector<Plant1Candidate>& plant1_candidates();
const Plant1Candidate& plant1_candidate(const std::string& label);

// Returns the bounds that all records share: positioner, installed characteristic, dead time, lags.
const std::vector<FitBound>& plant1_shared_bounds();
// Returns the bounds of each record's own parameters, before those of its effect. They are the
// divisor of both Ziegler-Nichols settings and the time of the set-point step, s.
const std::vector<FitBound>& plant1_own_bounds();

// Returns the published process and tuning; `divisor` applies to both settings.
plant::LoopModel plant1_published(const Plant1Record& record, double divisor, double step_time_s);
// `own` begins with the parameters of plant1_own_bounds(); the candidate's parameters follow.
plant::LoopModel plant1_corrected(const Plant1Record& record, std::span<const double> shared,
                                  std::span<const double> own, const Plant1Candidate& candidate);

// Returns PV of a free closed-loop run from rest with noise and resolution, as measured.
std::vector<double> plant1_run(const plant::LoopModel& model, std::size_t samples);
// Returns the mean square of simulated minus measured, divided by the record's variance.
double misfit(const Plant1Record& record, std::span<const double> simulated);
double fit_percent(double misfit);

}  // namespace loopwarden::lab
