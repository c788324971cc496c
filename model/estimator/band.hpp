// SPDX-License-Identifier: Apache-2.0
// Finds whether a routine record needs a band (stiction or backlash) in the valve, without a model
// of the loop.
//
// The process, the disturbance and the noise are unknown. The likelihood is summed over a grid of
// them; gain and level are in closed form. The size of the band relative to the
// movement of CO decides: a healthy valve shows small bands too (resolution, an inexact lag).
//
//   log odds = log(large) - log(none + small)
//
//   none            likelihood without a band
//   small, large    mean likelihood of the bands up to kSmall, and from kLarge on
//
// Negative odds of a piece count by (none + small) / (none + small + between): a band between both
// is possible in a sticking valve whose CO moves far.
// Equations, symbols and sources: docs/math/band.md. Errors: no exceptions.
// Limits: a band that CO crosses without a reversal can't be seen.
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace loopwarden::estimator {

struct BandGrid {
  // Bands as shares of CO's movement; the first is the valve without a band.
  static constexpr std::array<double, 12> kBands{0.0, 0.04, 0.08, 0.14, 0.2, 0.25,
                                                 0.3, 0.37, 0.46, 0.57, 0.7, 0.86};
  static constexpr std::size_t kFirst = 1;  // band of the grid
  static constexpr double kSmall = 0.15;    // of a healthy valve
  static constexpr double kLarge = 0.3;     // of a sticking valve
  // Pole of the process per sample; 1 integrates.
  static constexpr std::array<double, 6> kPoles{0.0, 0.5, 0.8, 0.93, 0.98, 1.0};
  static constexpr std::array<std::size_t, 6> kDelays{1, 2, 3, 5, 8, 12};  // samples
  // Share of an innovation that the disturbance keeps: 1 for a random walk, 0 for noise only.
  static constexpr std::array<double, 6> kWalks{0.003, 0.015, 0.06, 0.2, 0.5, 0.85};
  static constexpr std::array<double, 4> kColours{0.0, 0.5, 0.8, 0.94};  // of the innovations
  static constexpr double kRadius = 0.97;            // of the poles of an oscillating disturbance
  static constexpr double kDamping = 0.9;            // of that radius: radius of the zeros
  static constexpr double kResonance = 3.0;          // nats that an oscillating disturbance costs
  static constexpr std::size_t kSkipped = 5;         // samples, at the start
  static constexpr std::size_t kMostSamples = 1500;  // of a piece of a long record
  static constexpr std::size_t kMostPieces = 4;
  // Samples averaged into one; of these the one at which CO predicts PV best.
  static constexpr std::array<std::size_t, 3> kFactors{1, 4, 16};
  static constexpr std::size_t kLeastBlocks = 300;   // of a record of averaged samples
  static constexpr std::size_t kLeastReversals = 2;  // of the stem; fewer: an offset
  static constexpr double kMostNats = 30.0;          // of one piece
  static constexpr double kLeastNats = -10.0;        // of one piece
};

// The filter that makes disturbance and noise white.
struct ErrorModel {
  double walk = 0.0;    // share of an innovation that the disturbance keeps
  double colour = 0.0;  // of the innovations
  double turn = 0.0;    // 2 cos of the angle per sample of an oscillating disturbance
  bool oscillates = false;
};

// The process of one point of the grid.
struct BandProcess {
  double gain = 0.0;      // PV units per CO unit; for an integrating process per sample too
  double pole = 0.0;      // per sample; 1 integrates
  std::size_t delay = 0;  // samples
};

struct BandEvidence {
  double log_odds = 0.0;  // nats, mean over the pieces, each within kLeastNats to kMostNats
  double decided = 0.0;   // weight of a piece in the mean, 0 to 1
  // The piece with the highest log odds:
  std::array<double, BandGrid::kBands.size()> log_likelihood{};  // nats, above that of no band
  double band = 0.0;      // CO units, mean over the likelihood
  double low = 0.0;       // CO units, 5 % of the likelihood is below
  double high = 0.0;      // CO units, 5 % of the likelihood is above
  double share = 0.0;     // band over the movement of CO
  double movement = 0.0;  // of CO, CO units
  BandProcess process{};  // with the most likely band
  BandProcess without{};  // without a band
  ErrorModel error{};
  std::size_t factor = 1;    // samples averaged into one; the processes are of these
  double information = 0.0;  // nats per sample by which CO predicts PV
  double explained = 0.0;    // of PV's variance, slow movement removed, by the band in free run
  double explained_without = 0.0;  // the same without a band
};

// Returns the evidence of a record without missing samples. `period`: time scale of the movement,
// samples (diagnosis/time_scales.hpp). All 0 if PV or CO don't move, or below 50 samples.
BandEvidence find_band(std::span<const double> pv, std::span<const double> co, double period);

}  // namespace loopwarden::estimator
