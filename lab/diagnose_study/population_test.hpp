// SPDX-License-Identifier: Apache-2.0
// Do simulated loops look like measured ones, in all evidence together?
//
//   AUC      of a boosted classifier that tells measured loops from simulated ones, each plant judged by trees that have not
//            seen it: share of the simulated loops that get a lower score than a measured one, mean over the measured loops.
//            0.5: can't be told apart; 1: always. With each loop left out instead the other loops of its plant have their say:
//            what plants have each in their own way shows there only
//   energy   distance of the two, E = 2 E|x - y| - E|x - x'| - E|y - y'| over 2 E|x - y|, every number by its deviation; 0: the
//            same distribution. p: share of permutations of the loops with an E as large
//
// Every measured loop weighs alike, whatever its windows. Simulated loops are compared with measured ones of the same kind
// and label only, and weigh as these do: how many loops of a kind stick says nothing of how they look.
//
// Sources: D. Lopez-Paz and M. Oquab, Revisiting classifier two-sample tests (ICLR 2017); G. J. Szekely and M. L. Rizzo, J. Stat.
// Planning and Inference 143 (2013).
//
// What it can't do: prove that two populations are alike; few measured loops see large differences only.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "model/numeric/parallel.hpp"

namespace loopwarden::studies {

struct Evidence {
  std::vector<double> numbers;
  std::string plant;  // empty: simulated
  std::string loop;   // windows of one loop count as one; of a simulated one not used
  std::string kind;
  bool sticky = false;
};

struct PopulationTest {
  struct Plant {
    std::string name;
    std::size_t loops = 0;
    double auc = 0.5;
  };
  std::size_t loops = 0;      // measured
  std::size_t simulated = 0;  // of the same kinds and labels
  std::vector<Plant> plants;
  double auc = 0.5;  // with its 90 % bootstrap interval over loops
  double auc_low = 0.0;
  double auc_high = 1.0;
  double auc_loops_left_out = 0.5;  // the same with each loop left out in place of each plant
  double energy = 0.0;              // 0 to 1
  double p = 1.0;
};

// A measured loop without a simulated one of its kind and label is left out. Needs two plants; with fewer all is as by default.
PopulationTest test_population(const std::vector<Evidence>& simulated,
                               const std::vector<Evidence>& measured,
                               const numeric::ParallelFor& parallel);

}  // namespace loopwarden::studies
