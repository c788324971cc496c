// SPDX-License-Identifier: Apache-2.0
// Which effects are missing: a competition of hypotheses, each the model plus some effects.
//
// Candidates race: all are refined from a grid, and the best of those whose PV jumps with a
// parameter polished by evolution. The best few are each joined by every other, of which the best
// from the grid are refined, and the winner is tried again without each of its effects, so that a
// first name that was wrong is stepped back from. A hypothesis is scored by
//   score = (deviance of the model alone - deviance of the hypothesis)/2 - k/2 ln N - r
// with k parameters and N samples (Schwarz 1978), r what its effects are rarer than others (in
// their descriptors), on the first two thirds of the record. One that does nothing here that a
// simpler effect does not (low air whose limits are never reached is a lag) is no hypothesis. One
// bound to a place of the travel that CO never left and came back to is never chosen: what is alike
// without the place is, with it as alternative. Another effect is taken in only if its gain in
// score is clear, also on blocks of the record that are left out of the fit and spread over them (a
// t-test; but for what shows at one moment), large enough to matter in PV, and if it closes 5 % of
// the gap in free run; none is looked for where too little is left beside noise to matter. Of as
// many effects that the record can't tell apart, those with fewer parameters are chosen, then the
// commoner ones. Where PV jumps with a parameter of the winner, several evolutions land in several
// places; those that blocks left out can't tell from the likeliest are `alike`, and the caller
// chooses among them.
//
// Sources: Schwarz, Ann. Stat. 6 (1978) 461-464; Bacher and Madsen, Energy and Buildings 43 (2011)
// 1511-1522, for forward selection of physical models.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "model/gap/accept.hpp"
#include "model/gap/fit.hpp"
#include "model/numeric/parallel.hpp"

namespace loopwarden::gap {

using numeric::ParallelFor;

// Steps of the workflow that can be left out, to see what each brings.
struct SearchOptions {
  bool several = true;                 // more than one effect, with the step back
  bool load = true;                    // an unmeasured load is modelled
  bool allowances = true;              // a healthy valve's friction and momentum are allowed for
  std::vector<std::string> without{};  // names that are not given
  // Of a model that this record itself suggested: the model's level is the record's own and is
  // fitted (Level::of_record), and the search for a valve that sticks starts from what was found
  // with the model too: s, CO units, j/s and where the stem rested; empty: nothing.
  bool level_of_record = false;
  std::vector<double> sticks{};
};

struct Hypothesis {
  Fit fit;
  double score = 0.0;          // nats above the model alone
  double training_rmse = 0.0;  // PV units, free run
  bool placed = true;          // else bound to a place that CO doesn't show: an alternative at most
};

// Gain in log likelihood over blocks of the record, each left out of both fits.
struct Lead {
  double nats = 0.0;
  double t = 0.0;      // Student's, over the blocks
  double ahead = 0.0;  // share of the blocks with a gain
};
Lead lead_on_blocks_left_out(const Fitter& fitter, const Fit& more, const Fit& less);
// The same from the left_out_innovations() of both and the difference of their deviances.
Lead lead_between(const std::vector<double>& more, const std::vector<double>& less,
                  double deviance_less);

// Its fits point into the candidates that were searched, and must not outlive them.
struct SearchResult {
  Fit base;                                    // the model alone, within its uncertainty
  double base_rmse = 0.0;                      // PV units, first two thirds
  Hypothesis chosen;                           // without terms: none is missing
  std::vector<Hypothesis> alike;               // fits of its names that are as likely, best first
  std::vector<Hypothesis> singles;             // best of each name, best first
  std::vector<Hypothesis> tried;               // all
  std::vector<std::vector<std::string>> path;  // names after each step
};

bool contains(const Fit& fit, std::string_view name);
std::vector<std::string> names_in_order(const Fit& fit);
EffectSet effect_set_of(const Hypothesis& hypothesis);

// `progress` is told what is done of how much.
SearchResult search_effects(const Fitter& fitter, const std::vector<Candidate>& all,
                            const Scale& scale, const SearchOptions& options,
                            const ParallelFor& parallel,
                            const std::function<void(double)>& progress);

}  // namespace loopwarden::gap
