// SPDX-License-Identifier: Apache-2.0
// Levenberg-Marquardt training of a network: reduces the mean square error of its outputs.
//
//   (J'J + mu I) step = J'e,   w <- w + step if that lowers the error: mu / 10, otherwise mu * 10
//
// The normal matrix is computed without J. V are the last layer's weights, g the slopes of the
// tansig layers, and x, z1, z2 the layers' inputs (each with a 1 for the bias). Every block is a
// sum over the cases of a Kronecker product, such as (g1 W2' g2 V'V g2 W2 g1) x (x x'): one product
// of matrices. The output neurons are independent: each has the same block z2 z2', so they are
// eliminated first. For 31-31-31-31 that leaves two thousand unknowns instead of three thousand,
// and needs no Jacobian of 14 000 rows.
//
// Stops when one of these is met: epochs, goal, least gradient (length of J'e over the number of
// errors), validation failures in a row, largest mu. The weights with the least validation error
// are returned.
//
// The same inputs give the same bits.
//
// Sources: M. Hagan and M. Menhaj, IEEE Trans. Neural Networks 5 (1994) 989-993; the stops:
// Sewdass, thesis (Durban University of Technology), chapter 8, part C; mu as in the toolbox that
// the thesis used.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <vector>

#include "model/specialist/judge/network.hpp"

namespace loopwarden::specialist {

struct LearningSettings {
  std::size_t most_epochs = 1000;
  double goal = 1e-10;  // mean square error, scaled
  double least_gradient = 1e-10;
  std::size_t most_failures = 6;  // of validation, in a row
};

// Inputs and desired outputs, one column per case.
struct Lessons {
  Eigen::MatrixXd inputs;
  Eigen::MatrixXd targets;
};

struct Epoch {
  double training = 0.0;  // mean square errors, scaled
  double validation = 0.0;
  double test = 0.0;
  double gradient = 0.0;
  double mu = 0.0;
};

enum class Stop { epochs, goal, gradient, validation, mu };
const char* to_text(Stop stop) noexcept;

struct Learned {
  Network network;            // of the best epoch
  std::vector<Epoch> epochs;  // the first is before any step
  std::size_t best = 0;       // epoch with the least validation error
  Stop stop = Stop::epochs;
};

double mean_square_error(const Network& network, const Lessons& lessons);

// Trains from `start`. `test` is only measured. `on_epoch` is called with each epoch.
Learned learn(const Network& start, const Lessons& training, const Lessons& validation,
              const Lessons& test, const LearningSettings& settings,
              const std::function<void(std::size_t, const Epoch&)>& on_epoch = {});

}  // namespace loopwarden::specialist
