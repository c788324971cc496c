// SPDX-License-Identifier: Apache-2.0
// A feed-forward network with two hidden layers:
//
//   y = W3 tansig(W2 tansig(W1 x + b1) + b2) + b3,   tansig(a) = 2 / (1 + exp(-2 a)) - 1 = tanh(a)
//
//   x  inputs, without unit     y  outputs, without unit     W, b  weights and biases
//
// No errors; a non-finite input gives non-finite outputs.
// Limits: training is in levenberg_marquardt.hpp and team_training.hpp, reading of files in
// config/.
//
// Source: Sewdass, thesis (Durban University of Technology), section 8.4.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace loopwarden::specialist {

struct NetworkShape {
  std::size_t inputs = 0;
  std::size_t first_hidden = 0;
  std::size_t second_hidden = 0;
  std::size_t outputs = 0;

  std::size_t weights() const noexcept {
    return first_hidden * (inputs + 1) + second_hidden * (first_hidden + 1) +
           outputs * (second_hidden + 1);
  }
  friend bool operator==(const NetworkShape&, const NetworkShape&) = default;
};

struct Layer {
  Eigen::MatrixXd weights;  // outputs x inputs
  Eigen::VectorXd bias;
};

class Network {
 public:
  Network() = default;
  // Makes a network with all weights 0.
  explicit Network(const NetworkShape& shape);

  NetworkShape shape() const noexcept;
  // Returns the outputs, one column per case. Allocates.
  Eigen::MatrixXd respond(const Eigen::Ref<const Eigen::MatrixXd>& inputs) const;

  std::array<Layer, 3> layers;
};

// Returns random weights that spread the neurons over inputs from -1 to 1, after D. Nguyen and B.
// Widrow, Proc. IJCNN (1990) 3, 21-26. The weights of the last layer are small.
Network random_network(const NetworkShape& shape, std::uint64_t seed);

// A network with memory for a single case: no allocation after construction.
class Responder {
 public:
  explicit Responder(const Network& network);

  // Returns the outputs for as many `inputs` as the network has. The result is valid until the next
  // call.
  std::span<const double> respond(std::span<const double> inputs) noexcept;

 private:
  Network network_;
  std::array<Eigen::VectorXd, 3> activity_;
};

}  // namespace loopwarden::specialist
