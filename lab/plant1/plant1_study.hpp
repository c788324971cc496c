// SPDX-License-Identifier: Apache-2.0
// Not fitted by model/gap, which takes one record at a time: here five records share one corrected plant.
//
// What plant 1 lacks, and what each fault adds on top: published model, one corrected plant for the
// five measured records, and for each faulty record the competition of the catalogue's effects.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "lab/plant1/plant1_model.hpp"

namespace loopwarden::studies {

struct Plant1Work {
  std::uint64_t seed = 1;
  std::size_t generations = 2000;  // of the joint fit, on each island
  // The plant is that of the healthy record alone, and its divisor and step time hold for all of them.
  bool from_healthy = false;
  unsigned threads = 1;
  std::function<void(std::size_t done, std::size_t total)> progress{};  // may be empty
};

struct Plant1Trial {
  std::string name;  // in the catalogue
  std::string label;
  std::vector<double> own;  // divisor, time of the step, parameters
  double misfit = 0.0;
  double score = 0.0;  // least wins, see plant1_score()
};

struct Plant1Outcome {
  Plant1Record record;
  double published_divisor = 1.0;
  double published_misfit = 0.0;
  std::vector<double> published_pv;
  std::vector<double> own;  // of the joint fit, with the effect that was put in
  double corrected_misfit = 0.0;
  std::vector<double> corrected_pv;
  std::vector<Plant1Trial> trials;  // best first
};

struct Plant1Study {
  std::vector<double> shared;
  std::vector<Plant1Outcome> rows;
};

// The effect as which the joint fit takes a record of this condition. Throws std::logic_error for
// one it does not know.
const Plant1Candidate& plant1_effect_of(const std::string& condition);

// Bayesian information criterion with as many independent samples as the loop's response time
// leaves in the record: neighbours in a free run's residual say the same thing.
double plant1_score(double misfit, std::size_t parameters);

Plant1Study study_plant1_records(const std::vector<Plant1Record>& records, const Plant1Work& work);

// Measured, published and corrected, and the residual below.
std::string plant1_picture(const Plant1Outcome& row);

}  // namespace loopwarden::studies
