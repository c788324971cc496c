// SPDX-License-Identifier: Apache-2.0
#include "model/specialist/judge/network.hpp"

#include <cmath>

#include "model/numeric/random.hpp"

namespace loopwarden::specialist {
namespace {

using Index = Eigen::Index;

Layer layer(std::size_t outputs, std::size_t inputs) {
  const auto rows = static_cast<Index>(outputs);
  return {Eigen::MatrixXd::Zero(rows, static_cast<Index>(inputs)), Eigen::VectorXd::Zero(rows)};
}

void spread(Layer& l, numeric::Random& random) {
  const auto neurons = static_cast<double>(l.weights.rows());
  const auto inputs = static_cast<double>(l.weights.cols());
  const double length = 0.7 * std::pow(neurons, 1.0 / inputs);
  for (Index i = 0; i < l.weights.rows(); ++i) {
    for (Index k = 0; k < l.weights.cols(); ++k) l.weights(i, k) = random.uniform(-1.0, 1.0);
    l.weights.row(i) *= length / l.weights.row(i).norm();
    l.bias(i) = length * random.uniform(-1.0, 1.0);
  }
}

}  // namespace

Network::Network(const NetworkShape& s)
    : layers{layer(s.first_hidden, s.inputs), layer(s.second_hidden, s.first_hidden),
             layer(s.outputs, s.second_hidden)} {}

NetworkShape Network::shape() const noexcept {
  return {static_cast<std::size_t>(layers[0].weights.cols()),
          static_cast<std::size_t>(layers[0].weights.rows()),
          static_cast<std::size_t>(layers[1].weights.rows()),
          static_cast<std::size_t>(layers[2].weights.rows())};
}

Eigen::MatrixXd Network::respond(const Eigen::Ref<const Eigen::MatrixXd>& inputs) const {
  const Eigen::MatrixXd first =
      ((layers[0].weights * inputs).colwise() + layers[0].bias).array().tanh();
  const Eigen::MatrixXd second =
      ((layers[1].weights * first).colwise() + layers[1].bias).array().tanh();
  return (layers[2].weights * second).colwise() + layers[2].bias;
}

Network random_network(const NetworkShape& shape, std::uint64_t seed) {
  numeric::Random random(seed);
  Network network(shape);
  spread(network.layers[0], random);
  spread(network.layers[1], random);
  Layer& last = network.layers[2];
  for (double& weight : last.weights.reshaped()) weight = 0.1 * random.uniform(-1.0, 1.0);
  return network;
}

Responder::Responder(const Network& network) : network_(network) {
  for (std::size_t i = 0; i < 3; ++i) activity_[i].resize(network.layers[i].bias.size());
}

std::span<const double> Responder::respond(std::span<const double> inputs) noexcept {
  const Eigen::Map<const Eigen::VectorXd> x(inputs.data(), static_cast<Index>(inputs.size()));
  const std::array<Layer, 3>& l = network_.layers;
  activity_[0] = l[0].bias;
  activity_[0].noalias() += l[0].weights * x;
  activity_[0] = activity_[0].array().tanh();
  activity_[1] = l[1].bias;
  activity_[1].noalias() += l[1].weights * activity_[0];
  activity_[1] = activity_[1].array().tanh();
  activity_[2] = l[2].bias;
  activity_[2].noalias() += l[2].weights * activity_[1];
  return {activity_[2].data(), static_cast<std::size_t>(activity_[2].size())};
}

}  // namespace loopwarden::specialist
