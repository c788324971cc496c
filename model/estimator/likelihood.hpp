// SPDX-License-Identifier: Apache-2.0
// Log-likelihood of the coordinates of a hypothesis, with everything integrated out on which PV
// depends linearly.
//
//   r = W (PV - offset - z)    B = W [z, zT, zL, level, decays, c_i]    W  ErrorFilter of (q, c)
//   beta ~ N(0, D^2)   D  deviations by the uncertainty of the model (K' counts from 1)
//   log L = -1/2 (r'r - v' Q^-1 v + log det Q + log_determinant) - penalty of the slips
//   Q = I + D B'B D,  v = D B'r,   beta | PV ~ N(D Q^-1 v, D Q^-1 D)
//
// Constants that all hypotheses share are left out. docs/math/estimator.md has the derivation.
#pragma once

#include <Eigen/Dense>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "model/estimator/blocks.hpp"
#include "model/estimator/error_filter.hpp"
#include "model/estimator/hypothesis.hpp"
#include "model/estimator/loop_run.hpp"

namespace loopwarden::estimator {

// The linear parameters at one point, given the record.
struct Solution {
  double log_likelihood = 0.0;  // nats
  Eigen::VectorXd mean;         // K' - 1, ln T, dead time (s), level, decays, solved parameters
  Eigen::MatrixXd covariance;
  Eigen::MatrixXd design;       // the columns after the filter, in the order of the mean
  Eigen::VectorXd innovations;  // of each block, over their deviation, at the mean
  Eigen::VectorXd log_scales;   // log of their deviation in PV units; 0 for a missing block

  double gain() const { return 1.0 + mean(0); }  // K'
  // Solved parameters of each effect.
  std::vector<std::vector<double>> solved(const Hypothesis& hypothesis, std::size_t fixed) const;
};

// Further columns with their prior deviations (flexible.hpp): signals at every sample.
struct Extra {
  std::vector<std::vector<double>> signals;
  std::vector<double> deviations;
};

class Likelihood {
 public:
  // Uses the first `samples` samples. `slips`: of find_slips(). All arguments must
  // outlive it.
  Likelihood(const LoopFacts& loop, const LoopRun& run, const Observed& observed,
             std::size_t samples, double noise_rms, const Slips& slips);

  // Buffers of one thread, for one Likelihood.
  struct Work {
    // Of the last free run, if there is one: coordinates without those of the error, effects,
    // penalty of the slips.
    bool has_run = false;
    std::vector<double> place;
    Terms terms;
    bool guided = false;
    double penalty = 0.0;  // nats
    std::vector<double> columns[3];
    std::vector<double> stem;
    std::vector<std::vector<std::vector<double>>> solved;  // by effect
    std::vector<const std::vector<double>*> signals;       // in the order of Solution::mean
    std::vector<double> prior;                             // deviation of each
    std::vector<std::vector<double>> means;                // of the signals over blocks
    Eigen::MatrixXd white;                                 // after the filter; the last one: PV
    const Extra* extra = nullptr;
    std::size_t evaluations = 0;  // free runs
  };
  double of(const Hypothesis& hypothesis, std::span<const double> z, Work& work,
            Solution* solution = nullptr) const;

  // PV of the first `samples` samples of the free run: with the law's own slips, or with `slips`
  // if they are not null.
  std::vector<double> simulate(const Hypothesis& hypothesis, std::span<const double> z,
                               const Solution& solution, std::size_t samples,
                               const Extra* extra = nullptr, const Slips* slips = nullptr) const;

  const LoopFacts& loop() const noexcept { return loop_; }
  const LoopRun& run() const noexcept { return run_; }
  const Blocks& blocks() const noexcept { return blocks_; }
  const ErrorGrid& errors() const noexcept { return errors_; }
  double noise_rms() const noexcept { return noise_rms_; }
  std::size_t fixed() const noexcept { return fixed_.size(); }
  // Largest values that the model's own uncertainty allows to K' - 1, ln T, dead time and level.
  double allowed(std::size_t column) const noexcept { return prior_[column]; }

 private:
  struct White {              // PV and the fixed columns after a filter
    Eigen::MatrixXd columns;  // fixed ones, then PV
  };
  double prior_of(const Hypothesis& hypothesis, std::size_t column) const noexcept;
  void add_jumps(const Point& point, const std::vector<double>& stem,
                 std::vector<double>& variance) const;
  void collect(const Hypothesis& hypothesis, const Point& point, Work& work) const;
  void whiten(std::size_t index, const ErrorFilter* filter, Work& work) const;
  static void whiten(const ErrorFilter& filter,
                     std::span<const std::pair<const double*, std::size_t>> in, Work& work);
  void whiten_bent(const Hypothesis& hypothesis, const Point& point, const Eigen::VectorXd& mean,
                   const ErrorFilter& filter, Work& work) const;
  double solve(const ErrorFilter& filter, Work& work, Solution* solution) const;

  const LoopFacts& loop_;
  const LoopRun& run_;
  const Observed& observed_;
  double noise_rms_;
  Blocks blocks_;
  ErrorGrid errors_;
  const Slips& slips_;
  std::vector<double> pv_;                  // means, offset taken off
  std::vector<std::vector<double>> fixed_;  // means of the level and the decays
  std::vector<double> prior_;               // deviations of K', ln T, dead time and fixed ones
  std::vector<White> white_;                // by filter
};

}  // namespace loopwarden::estimator
