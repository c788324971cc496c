// SPDX-License-Identifier: Apache-2.0
// The loop of the thesis's plant 1 as the study of its five measured records believes it to be:
// published, corrected, and with one more effect added.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "model/plant/loop_model.hpp"
#include "lab/plant1/shared_fit.hpp"

namespace loopwarden::studies {

inline constexpr double kPlant1PeriodS = 0.1;  // of its records

struct Plant1Record {
  std::string name;        // P1N22
  std::string condition;   // no_fault, or the effect that was put in
  std::vector<double> pv;  // L/min, at 10 Hz
  double rest = 0.0;       // L/min, reading of the closed valve: mean before the flow begins
  double noise = 0.0;      // L/min, standard deviation there
  double variance = 0.0;   // (L/min)^2, of the whole record
};

// `pv` without gaps, at least 100 samples of which the first 20 are at rest.
Plant1Record plant1_record(std::string name, std::string condition, std::vector<double> pv);

// One effect of the catalogue, to be put on top of the plant.
struct Plant1Candidate {
  std::string name;   // as in the catalogue; "none"
  std::string label;  // the same with its variant
  std::vector<FitBound> bounds;
  std::function<void(std::span<const double> parameters, plant::LoopModel&)> add;
};

// All that compete, "none" first. The valve's stand before its positioner: where the thesis's
// software blocks stood.
const std::vector<Plant1Candidate>& plant1_candidates();
const Plant1Candidate& plant1_candidate(const std::string& label);

// What all records share: positioner, installed characteristic, dead time, lags.
const std::vector<FitBound>& plant1_shared_bounds();
// What each record has of its own, in front of its effect's parameters: the divisor of both
// Ziegler-Nichols settings, and when the set point steps, s.
const std::vector<FitBound>& plant1_own_bounds();

// The published process and tuning; `divisor` of both settings.
plant::LoopModel plant1_published(const Plant1Record& record, double divisor, double step_time_s);
// `own` begins with what plant1_own_bounds() names and goes on with the candidate's parameters.
plant::LoopModel plant1_corrected(const Plant1Record& record, std::span<const double> shared,
                                  std::span<const double> own, const Plant1Candidate& candidate);

// PV of a free closed-loop run from rest, as measured: with noise and resolution.
std::vector<double> plant1_run(const plant::LoopModel& model, std::size_t samples);
// Mean square of simulated minus measured over the record's variance.
double misfit(const Plant1Record& record, std::span<const double> simulated);
double fit_percent(double misfit);

}  // namespace loopwarden::studies
