// SPDX-License-Identifier: Apache-2.0
// Finds the deficits of plant 1's model and the effect of each fault. It compares the published
// model with one corrected plant for the five measured records. For each faulty record, the
// catalogue's effects compete.
//
// model/gap is not used, because it fits one record at a time, while here five records share one
// corrected plant.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "lab/plant1/plant1_model.hpp"

namespace loopwarden::lab {

struct Plant1Work {
  std::uint64_t seed = 1;
  std::size_t generations = 2000;  // of the joint fit, on each island
  // Fits the plant to the healthy record only, and uses its divisor and step time for all records.
  bool from_healthy = false;
  unsigned threads = 1;
  std::function<void(std::size_t done, std::size_t total)> progress{};  // may be empty
};

struct Plant1Trial {
  std::string name;  // in the catalogue
  std::string label;
  std::vector<double> own;  // divisor, time of the step, parameters
  double misfit = 0.0;
  double score = 0.0;  // the smallest one wins, see plant1_score()
};

struct Plant1Outcome {
  Plant1Record record;
  double published_divisor = 1.0;
  double published_misfit = 0.0;
  std::vector<double> published_pv;
  std::vector<double> own;  // of the joint fit, with the added effect
  double corrected_misfit = 0.0;
  std::vector<double> corrected_pv;
  std::vector<Plant1Trial> trials;  // best first
};

struct Plant1Study {
  std::vector<double> shared;
  std::vector<Plant1Outcome> rows;
};

// Returns the effect that the joint fit uses for a record of this condition. Throws
// std::logic_error for an unknown one.
const Plant1Candidate& plant1_effect_of(const std::string& condition);

// Returns the Bayesian information criterion. The number of independent samples follows from the
// loop's response time, because neighbouring residuals of a free run are dependent.
double plant1_score(double misfit, std::size_t parameters);

Plant1Study study_plant1_records(const std::vector<Plant1Record>& records, const Plant1Work& work);

// Returns a picture of measured, published and corrected PV with the residual below.
std::string plant1_picture(const Plant1Outcome& row);

}  // namespace loopwarden::lab
