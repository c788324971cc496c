// SPDX-License-Identifier: Apache-2.0
// The rules of the search, on scores alone: when one more effect is taken in, when one is stepped
// back from, and by how much a name leads. Limits: constants.hpp.
//
// What they can't do: a score compares sets of effects on one record; whether the best one is good
// is asked by decide.hpp.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::gap {

// A set of effects that was tried.
struct EffectSet {
  std::vector<std::string> names;  // none: the model alone
  double score = 0.0;              // nats above the model alone
  double training_rmse = 0.0;      // PV units, free run
  bool placed = true;              // else an alternative at most (search.hpp), and nobody's rival

  bool has(std::string_view name) const noexcept;
};

// What counts as large.
struct Scale {
  double noise_rms = 0.0;  // PV units, of the record
  double least_rms = 0.0;  // PV units, of what matters
};

// One more effect.
struct Addition {
  double score_with = 0.0;     // nats
  double score_without = 0.0;  // nats
  bool first = true;           // nothing was missing yet
  bool at_one_moment = false;  // it shows at one place of the record: need not gain in all of it
  double moves_pv = 0.0;       // PV units rms, apart from the free run without it
  double least_rms = 0.0;      // PV units, of what matters
  double left_out_nats = 0.0;  // gain over the blocks of the record, each left out of the fit
  double block_t = 0.0;        // Student's t of the same
  double rmse_with = 0.0;      // PV units, free run
  double rmse_without = 0.0;   // PV units, free run
  double rmse_model = 0.0;     // PV units, free run of the model alone
  double noise_rms = 0.0;      // PV units, of the record
};
bool worth_adding(const Addition& addition) noexcept;

// Whether a free run leaves so much beside noise that one more effect could matter. `rmse` in PV
// units.
bool leaves_more(double rmse, const Scale& scale) noexcept;

// Whether one effect closes so much of the gap that it is no misfit of the others. All in PV units,
// free runs.
bool closes_a_part(double rmse_with, double rmse_without, double rmse_model,
                   double noise_rms) noexcept;

// The others do as well without it.
bool superfluous(double score_with, double score_without) noexcept;

// Whether `rest`, what is left of a larger set that was accepted, is a better choice than the
// smaller set chosen before: by its score, or since it closes a part of the gap and the other none,
// however likely a load makes that one.
bool replaces(const EffectSet& rest, const EffectSet& chosen, double rmse_model,
              double noise_rms) noexcept;

// Nats by which each name of `chosen` leads over the best set of as many effects or fewer that does
// without it.
std::vector<double> leads(const EffectSet& chosen, std::span<const EffectSet> tried);

}  // namespace loopwarden::gap
