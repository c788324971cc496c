// SPDX-License-Identifier: Apache-2.0
// Tests whether simulated loops resemble measured ones in all evidence together.
//
//   AUC     of a boosted classifier that distinguishes measured from simulated loops. Trees that
//           score a plant were not trained on it. AUC is the share of the simulated loops with a
//           lower score than a measured one, averaged over the measured loops. 0.5: not
//           distinguishable; 1: always distinguishable. If each loop is left out instead of each
//           plant, the other loops of its plant are used for training. Differences between plants
//           affect only this second value.
//   energy  distance of the two, E = 2 E|x - y| - E|x - x'| - E|y - y'| over 2 E|x - y|, with each
//           number divided by its deviation; 0: the same distribution. p: share of permutations of
//           the loops with an E at least as large
//
// All measured loops have equal weight, whatever the number of their windows. Simulated loops are
// compared only with measured ones of the same kind and label, and have the same total weight. The
// share of sticking loops of a kind therefore has no effect.
//
// Sources: D. Lopez-Paz and M. Oquab, Revisiting classifier two-sample tests (ICLR 2017); G. J.
// Szekely and M. L. Rizzo, J. Stat. Planning and Inference 143 (2013).
//
// Limits: it can't prove that two populations are alike. With few measured loops it finds large
// differences only.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "model/numeric/parallel.hpp"

namespace loopwarden::lab {

struct Evidence {
  std::vector<double> numbers;
  std::string plant;  // empty: simulated
  std::string loop;   // windows of one loop count as one; unused for simulated loops
  std::string kind;
  bool sticky = false;
};

struct PopulationTest {
  struct Plant {
    std::string name;
    std::size_t loops = 0;
    double auc = 0.5;
  };
  std::size_t loops = 0;      // number of measured loops
  std::size_t simulated = 0;  // number of simulated loops of the same kinds and labels
  std::vector<Plant> plants;
  double auc = 0.5;  // with its 90 % bootstrap interval over loops
  double auc_low = 0.0;
  double auc_high = 1.0;
  double auc_loops_left_out = 0.5;  // the same with each loop left out instead of each plant
  double energy = 0.0;              // 0 to 1
  double p = 1.0;
};

// Leaves out measured loops without a simulated one of their kind and label. Needs two plants; with
// fewer, all members keep their defaults.
PopulationTest test_population(const std::vector<Evidence>& simulated,
                               const std::vector<Evidence>& measured,
                               const numeric::ParallelFor& parallel);

}  // namespace loopwarden::lab
