// SPDX-License-Identifier: Apache-2.0
// Fits the model plus some effects to a record, by free-run simulation driven by the measured CO.
//
// Maximum likelihood under white noise and, where the record asks for it, a wandering load
// (load_filter.hpp). What PV depends on linearly is solved for at every step of the search; the
// rest is searched from a grid: by Levenberg and Marquardt's method within bounds where PV is
// smooth in it, by Subplex and differential evolution where it sticks and jumps. Gain, time
// constant and dead time stay within the model's stated uncertainty, so that neither a small misfit
// is called an effect nor an effect is swallowed.
//
// Sources: Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413-432 (variable projection);
// Marquardt, J. SIAM 11 (1963) 431-441; Rowan, Subplex (1990), in Johnson's NLopt; Storn and Price,
// J. Global Optimization 11 (1997) 341-359 (differential evolution).
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "model/gap/free_run.hpp"
#include "model/gap/load_filter.hpp"

namespace loopwarden::gap {

// What may wander under PV besides noise, each over the record's noise (load_filter.hpp).
struct AllowedWander {
  double load = 0.0;   // the most that a load may have
  double valve = 0.0;  // the most that a healthy valve may leave
};

struct Fit {
  Terms terms;
  Point point;
  std::vector<double> solved;  // K', c1, c2 and so on (FreeRun), then each term's
  std::size_t load = 0;        // index of the filter it was judged with
  double deviance = 0.0;       // -2 log likelihood; less is better
  double noise_rms = 0.0;      // PV units, of the innovations
  std::size_t samples = 0;     // used
};

// Whether PV jumps with a parameter: a valve that sticks.
bool jumps(const Terms& terms);

class Fitter {
 public:
  // Uses the samples where `used` is true. `free_run` must outlive it.
  // Without `allowances` no friction and momentum of a healthy valve.
  Fitter(const FreeRun& free_run, const std::vector<double>& pv, const std::vector<bool>& used,
         AllowedWander allowed, bool allowances);

  // Holds the fitted level at the model's own (true), or fits it again (false). Fits made before
  // keep theirs.
  void hold_level(bool hold) noexcept { level_held_ = hold; }

  // Friction that a healthy valve may have, of the output's span.
  static constexpr double kHealthyFriction = 0.003;
  // No more load was allowed: what is left may be something else.
  bool load_at_limit(const Fit& fit) const noexcept;
  double load_ratio(const Fit& fit) const noexcept { return filters_[fit.load].load_ratio(); }
  double valve_ratio(const Fit& fit) const noexcept { return filters_[fit.load].valve_ratio(); }

  // The model as it is with its own parameters within their uncertainty.
  Fit fit_model() const;
  // Adds one effect to `base`, from a grid over its parameters: the places from which it is worth
  // going on, best first, all under the same little load. For a sticking valve `hint` is what was
  // found for it without the others, and spares most of the search.
  std::vector<Fit> approach(const Fit& base, const Candidate& candidate,
                            const std::vector<double>* hint = nullptr) const;
  // The best of where they lead, all parameters jointly.
  Fit settle(const std::vector<Fit>& starts) const;
  // Where PV jumps with a parameter: all jointly once more, by evolution, which lands elsewhere
  // with another `seed`. `wide`: over half of the range of each of the effects' own and of the
  // actuator. Into `close`, where a larger load was chosen, the fit that was closest to PV before
  // that.
  struct Evolution {
    std::size_t evaluations;
    std::uint64_t seed;
    bool wide;
  };
  Fit polish(const Fit& start, const Evolution& how, Fit* close = nullptr) const;
  // All jointly, from where `start` stands.
  Fit refine(const Fit& start, int evaluations) const;
  // Without term `index`, refined.
  Fit fit_without(const Fit& fit, std::size_t index, int evaluations) const;

  // Whether each effect is more than a simpler one under this CO.
  bool tells(const Fit& fit) const;
  // Whether this CO shows the place of each effect that is bound to one.
  bool shows_places(const Fit& fit) const;

  // PV in free run, from the fit's own state at the first sample.
  std::vector<double> simulate(const Fit& fit) const;
  // Innovations of the used samples in units of their standard deviation, and which samples they
  // are.
  std::vector<double> innovations(const Fit& fit) const;
  // The same of blocks of the samples used, each left out of the fit: what the others say of it, to
  // first order in the parameters; what stands at a bound is held there.
  std::vector<double> left_out_innovations(const Fit& fit, std::size_t blocks) const;
  // Of the free run over the samples used. Samples from `training_end` on were never used.
  double training_rmse(const Fit& fit) const;
  std::size_t training_end() const noexcept { return training_end_; }
  // Standard deviations of the searched and solved parameters of term `index`, by the curvature.
  std::vector<double> spread(const Fit& fit, std::size_t index) const;
  // The level beyond the model's and its standard deviation, PV units; 0 if it is not fitted.
  double fitted_level(const Fit& fit) const { return free_run_.fitted_level(fit.solved); }
  double level_spread(const Fit& fit) const;

 private:
  struct Work;
  // Those of the free run up to the end of the fit, without the level if it is held.
  void columns(Work& work, const Terms& terms, const Point& point) const;
  // As simulate(), before the transmitter hides or bends any of it.
  std::vector<double> whole(const Fit& fit) const;
  double evaluate(Work& work, const Terms& terms, const Point& point, std::size_t load,
                  Fit* fit) const;
  double solve(Work& work, const Terms& terms, const Point& point, std::size_t load,
               Fit* fit) const;
  // Into `work`: columns and target as the transmitter shows them, around what is solved for.
  void linearise_shown(Work& work, const Terms& terms, const Point& point, std::size_t load) const;
  void choose_load(Work& work, Fit& fit) const;
  Fit search(Work& work, const Fit& start, int evaluations) const;
  Fit evolve(Work& work, const Fit& start, const Evolution& how) const;
  Fit descend(Work& work, const Fit& start, int iterations) const;
  // Places to start from for the stiction that is the last term, and where they lead by ever longer
  // runs.
  struct Sticking;
  struct StickingStart;
  struct GridPlace;
  std::vector<Fit> sticking_tries(Work& work, const Fit& fit,
                                  const std::vector<double>* hint) const;
  std::vector<Fit> grid_tries(Work& work, Fit fit, std::size_t base_load) const;
  std::vector<Fit> sticking_starts(const Fit& with, const std::vector<double>* hint) const;
  void lead_on(StickingStart& from, const Sticking& sticking, std::size_t longer) const;
  std::vector<double> first_steps(const Fit& fit) const;
  // What the filter makes of PV's change with each position and each solved number, in this order.
  // Of position `at` with all others held: where the deviance is not yet clearly higher.
  std::array<double, 2> likely_places(const Fit& fit, std::size_t at) const;
  Eigen::MatrixXd jacobian(const Fit& fit) const;
  // Of the searched and the solved numbers, in this order.
  Eigen::MatrixXd covariance(const Fit& fit) const;
  Point with_positions(const Terms& terms, const std::vector<double>& x) const;
  std::vector<double> positions(const Fit& fit) const;

  const FreeRun& free_run_;
  std::array<effects::SearchRange, 2> actuator_;
  double healthy_friction_;         // CO units, most that is allowed
  double dead_time_uncertainty_s_;  // s; half a sample on top of the model's: sampling hides that
  bool allowances_;
  bool level_held_ = false;
  std::size_t training_end_ = 0;
  std::vector<bool> used_;
  std::vector<double> pv_;  // PV units, offset taken off, 0 where not used
  double pv_square_ = 1.0;  // PV units squared, mean of the samples used
  std::vector<LoadFilter> filters_;
  std::vector<std::vector<double>> white_pv_;  // by each filter
};

}  // namespace loopwarden::gap
