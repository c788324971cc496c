// SPDX-License-Identifier: Apache-2.0
// Numbers that decide something, with unit and source. `lab/estimator_study` measures them.
#pragma once

#include <array>
#include <cstddef>

namespace loopwarden::estimator {

struct Limits {
  // Blocks (blocks.hpp). By hand: PV moves by a tenth of a step during a block.
  double block_share = 0.1;  // of the time constant
  std::size_t fewest_blocks = 600;
  std::size_t most_blocks = 2000;
  double least_noise = 2e-5;  // of the PV span

  // Error (error_filter.hpp). A larger disturbance is unexplained.
  double largest_disturbance = 0.0015;  // of the PV span per root second
  std::array<double, 7> disturbances{0.0, 0.06, 0.15, 0.28, 0.45, 0.7, 1.0};  // of the largest
  // Shares of the PV span.
  std::array<double, 9> law_errors{1e-4, 4e-4, 1e-3, 2e-3, 4e-3, 8e-3, 1.6e-2, 3.2e-2, 6.4e-2};
  double law_at_rest = 0.1;  // share of the law's variance while CO rests

  // Priors: standard deviations of what is solved for (likelihood.hpp).
  double uncertainty = 0.6;    // of the uncertainty that the model states
  double changed_gain = 0.35;  // of the gain, for gain_change
  double level = 0.002;        // of K times the CO span
  double free_level = 1.0;     // of the PV span: if the model doesn't know the process
  double start = 0.1;          // of the PV span: state at the first sample
  double solved = 0.06;        // of the PV span: rms in PV of a solved parameter
  double wide = 0.3;           // a larger uncertainty makes a time constant a coordinate

  // Slips by PV (slips.hpp).
  double early = 0.15;            // of fs: a slip that PV shows may be so much earlier
  double friction_varies = 0.04;  // of fs: standard deviation from slip to slip
  double least_jump = 0.004;      // of the CO span
  double jump_noise = 6.0;        // standard deviations
  std::array<double, 4> jitters{0.3, 0.1, 0.03, 0.0};  // of a jump: error of its moment
  double healthy_friction = 0.003;                     // of the CO span

  // Search (population.hpp).
  std::size_t members = 24;
  std::size_t jumping_members = 48;
  double kept = 0.25;  // effective share of the members after a step

  // Competition (competition.hpp), nats.
  double first_lead = 5.0;  // Kass and Raftery (1995): very strong
  double further_lead = 12.0;
  double least_t = 1.7;       // of the lead over the parts of the record
  double least_share = 0.05;  // of the gap, for a further effect

  // Judgement (judgement.hpp).
  std::size_t parts = 20;   // of the record
  std::size_t draws = 400;  // of the bootstrap
  // Relative error of a parameter because no law is exactly the plant's, standard deviations:
  // stick band and damping; what the shape of a law decides, as a factor (slip jump, width of a
  // hysteresis, lag of a drive); times and frequencies of lags; others. Measured on physical plants
  // (LuGre, Karnopp, Bouc-Wen, third poles) by lab/estimator_study, seeds 601100 to 610113.
  double missing_size = 0.09;
  double missing_shape = 0.29;
  double missing_times = 0.03;
  double missing_other = 0.015;
  double law_share = 0.15;  // of the gap: the most that the law's own error may be
  // Probability that no law of the catalogue is the cause: if the winner explains the record down
  // to its floor, if only the law's own error explains what is left, and if it explains neither.
  // By hand; to be calibrated on truths outside the catalogue.
  std::array<double, 3> unnamed{0.03, 0.1, 0.9};
  double most_confidence = 0.99;
  // Lead of a law without a name over the chosen one, nats. Right names: 0 to 10 (seeds 601100 to
  // 601117); truths outside the catalogue: 9 to 90 (seeds 601300 to 601317).
  double flexible_lead = 25.0;
  double most_with_flexible = 0.7;  // of the confidence, from a lead of further_lead on
  double most_inexact = 0.89;       // if only the law's own error explains what is left
  double most_learned = 0.89;       // a law without a name can't be right or wrong
  double least_closed = 0.5;        // share of the gap, last third
  double least_fitted = 0.2;        // share of the gap, fitted part
  double floors = 2.5;              // remaining error of a right name, in floors
};
inline constexpr Limits kLimits{};

}  // namespace loopwarden::estimator
