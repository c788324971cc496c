// SPDX-License-Identifier: Apache-2.0
// How sure: whether what a hypothesis leaves looks like noise and a quiet load, and how far the
// name is ahead of the others.
//
// A confidence is the share of right names among those that were given with as much of a lead, in
// simulated cases with a known truth: (right + 1) / (names + 2) of the row of kConfidenceTable. The
// table is written by `loopwarden-study gap --calibrate` (lab/gap_study/calibration.hpp has the
// method), which says in it from which cases; they are to be made again whenever the search
// changes.
//
// What it can't do: these are shares of that mixture of effects, records and believed models. A
// plant whose faults are others has other shares; in a real record the truth is rarely one law of
// the catalogue.
#pragma once

#include <span>
#include <vector>

#include "model/gap/search.hpp"

namespace loopwarden::gap {

// Names given with a lead of so many nats or more, up to the next row.
struct ConfidenceRow {
  double from_nats = 0.0;
  int names = 0;
  int right = 0;
};

struct ConfidenceTable {
  std::span<const ConfidenceRow> rest_is_noise;  // of effects; rising, the first from 0 nats
  std::span<const ConfidenceRow> rest_is_more;
  ConfidenceRow controller;
};
extern const ConfidenceTable kConfidenceTable;

struct Residuals {
  double noise_ratio = 1.0;  // innovations' noise over the record's own, 1 where all is explained
  double load_intensity = 0.0;  // PV units per root second
  double quiet_rmse = 0.0;      // PV units: of the free run's, by noise, load and a healthy valve
  double tail = 0.0;            // kurtosis of the innovations, 3 for Gaussian noise
  double answer = 0.0;          // F ratio of the innovations regressed on past moves of CO
  double closed = 0.0;     // share of the gap that the hypothesis closes on the data of the fit
  bool adequate = true;    // noise and a quiet load account for what is left
  bool believable = true;  // adequate, or so much is explained that the name stands
};

// Of `hypothesis`; `base_rmse` in PV units: of the model alone, first two thirds.
Residuals examine(const Fitter& fitter, const Hypothesis& hypothesis, double base_rmse,
                  const std::vector<double>& co, double record_noise, double period_s);

bool is_noise(double noise_ratio, double tail, double answer, bool load_at_limit) noexcept;

// 0 to 1, of an effect whose explanation leads by `lead_nats` over the best one without it.
double confidence(double lead_nats, bool rest_is_noise,
                  const ConfidenceTable& table = kConfidenceTable) noexcept;
// Of other settings of the controller, found by replaying it.
double controller_confidence(const ConfidenceTable& table = kConfidenceTable) noexcept;

}  // namespace loopwarden::gap
