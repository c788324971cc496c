// SPDX-License-Identifier: Apache-2.0
// How sure: whether what a hypothesis leaves looks like noise and a quiet load, and how far the name
// is ahead of the others.
#pragma once

#include <vector>

#include "model/gap/search.hpp"

namespace loopwarden::gap {

struct Residuals {
  double noise_ratio = 1.0;  // innovations' noise over the record's own, 1 where all is explained
  double load_intensity = 0.0;  // PV units per root second
  double floor_rmse = 0.0;      // PV units: noise, and what the load adds to a free run
  double tail = 0.0;            // kurtosis of the innovations, 3 for Gaussian noise
  double answer = 0.0;          // F ratio of the innovations regressed on past moves of CO
  double closed = 0.0;     // share of the gap that the hypothesis closes on the data of the fit
  bool adequate = true;    // noise and a quiet load account for what is left
  bool believable = true;  // adequate, or so much is explained that the name stands
};

Residuals examine(const Fitter& fitter, const SearchResult& search, const std::vector<double>& co,
                  double record_noise, double period_s);

// Of term `index` of the chosen hypothesis, 0 to 1.
double confidence(const SearchResult& search, std::size_t index, const Residuals& left);

}  // namespace loopwarden::gap
