// SPDX-License-Identifier: Apache-2.0
#include "model/specialist/judge/network.hpp"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cmath>

#include "model/specialist/train/levenberg_marquardt.hpp"

namespace network_test {

using namespace loopwarden::specialist;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// All weights in order: layer by layer, neuron by neuron, its bias last.
VectorXd flat(const Network& n) {
  std::vector<double> v;
  for (const Layer& l : n.layers) {
    for (Eigen::Index i = 0; i < l.weights.rows(); ++i) {
      for (Eigen::Index k = 0; k < l.weights.cols(); ++k) v.push_back(l.weights(i, k));
      v.push_back(l.bias(i));
    }
  }
  return Eigen::Map<VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
}

Network nudged(Network n, Eigen::Index which, double by) {
  Eigen::Index next = 0;
  for (Layer& l : n.layers) {
    for (Eigen::Index i = 0; i < l.weights.rows(); ++i) {
      for (Eigen::Index k = 0; k < l.weights.cols(); ++k) {
        if (next++ == which) l.weights(i, k) += by;
      }
      if (next++ == which) l.bias(i) += by;
    }
  }
  return n;
}

Lessons some_lessons(Eigen::Index inputs, Eigen::Index outputs, Eigen::Index cases) {
  Lessons l{MatrixXd(inputs, cases), MatrixXd(outputs, cases)};
  for (Eigen::Index s = 0; s < cases; ++s) {
    for (Eigen::Index i = 0; i < inputs; ++i) {
      l.inputs(i, s) = std::sin(1.3 * static_cast<double>(s) + 2.1 * static_cast<double>(i));
    }
    for (Eigen::Index o = 0; o < outputs; ++o) {
      l.targets(o, s) = std::cos(0.7 * static_cast<double>(s) - static_cast<double>(o));
    }
  }
  return l;
}

Network lively_network(const NetworkShape& shape) {
  Network n = random_network(shape, 5);
  n.layers[2].weights *= 8.0;
  return n;
}

}  // namespace

TEST_CASE("a network answers according to its formula", "[specialist]") {
  Network n(NetworkShape{2, 1, 1, 1});
  n.layers[0].weights << 0.5, -0.25;
  n.layers[0].bias << 0.1;
  n.layers[1].weights << 2.0;
  n.layers[1].bias << -0.3;
  n.layers[2].weights << 3.0;
  n.layers[2].bias << 0.7;
  const double z1 = std::tanh(0.5 * 1.0 - 0.25 * 2.0 + 0.1);
  const double expected = 3.0 * std::tanh(2.0 * z1 - 0.3) + 0.7;
  const std::array<double, 2> in{1.0, 2.0};
  CHECK(Responder(n).respond(in)[0] == Approx(expected));
  CHECK(n.respond(Eigen::Map<const VectorXd>(in.data(), 2))(0, 0) == Approx(expected));
}

TEST_CASE("a step is that of the full Jacobian", "[specialist]") {
  const NetworkShape shape{4, 3, 2, 3};
  const Network n = lively_network(shape);
  const Lessons l = some_lessons(4, 3, 20);
  const auto size = static_cast<Eigen::Index>(shape.weights());
  MatrixXd jacobian(l.targets.size(), size);
  for (Eigen::Index p = 0; p < size; ++p) {
    constexpr double kSmall = 1e-6;
    const MatrixXd slope =
        (nudged(n, p, kSmall).respond(l.inputs) - nudged(n, p, -kSmall).respond(l.inputs)) /
        (2.0 * kSmall);
    jacobian.col(p) = slope.reshaped();
  }
  const MatrixXd left = l.targets - n.respond(l.inputs);
  const VectorXd error = left.reshaped();
  LearningSettings settings;
  settings.most_epochs = 1;
  const Learned learned = learn(n, l, l, {}, settings);
  REQUIRE(learned.best == 1);
  MatrixXd normal = jacobian.transpose() * jacobian;
  normal.diagonal().array() += 10.0 * learned.epochs[1].mu;  // the step divided it by 10
  const VectorXd expected = normal.ldlt().solve(jacobian.transpose() * error);
  const VectorXd got = flat(learned.network) - flat(n);
  CHECK((got - expected).norm() < 1e-5 * expected.norm());
}

TEST_CASE("training lowers the error and keeps the best epoch of the validation", "[specialist]") {
  const Lessons training = some_lessons(3, 2, 24);
  const Lessons validation = some_lessons(3, 2, 9);
  const Network start = lively_network({3, 4, 4, 2});
  LearningSettings settings;
  settings.most_epochs = 40;
  const Learned learned = learn(start, training, validation, {}, settings);
  REQUIRE(learned.epochs.size() > 3);
  CHECK(learned.epochs.back().training < 0.5 * learned.epochs.front().training);
  for (const Epoch& e : learned.epochs) {
    CHECK(learned.epochs[learned.best].validation <= e.validation);
  }
  CHECK(mean_square_error(learned.network, validation) ==
        Approx(learned.epochs[learned.best].validation));
}

TEST_CASE("training ends by each of its stops", "[specialist]") {
  const Lessons training = some_lessons(3, 2, 24);
  const Network start = lively_network({3, 4, 4, 2});
  LearningSettings settings;
  settings.most_epochs = 2;
  CHECK(learn(start, training, training, {}, settings).stop == Stop::epochs);
  settings.goal = 1e6;
  CHECK(learn(start, training, training, {}, settings).stop == Stop::goal);
  settings.goal = 0.0;
  settings.least_gradient = 1e6;
  CHECK(learn(start, training, training, {}, settings).stop == Stop::gradient);
  settings.least_gradient = 0.0;
  settings.most_epochs = 1000;
  settings.most_failures = 3;
  // Progress on the lessons is a loss on their opposite.
  const Lessons opposite{training.inputs, -training.targets};
  const Learned failed = learn(start, training, opposite, {}, settings);
  CHECK(failed.stop == Stop::validation);
  CHECK(failed.epochs.size() == failed.best + 4);
  // Only the mean can be learned from a constant input: in the end no step helps.
  settings.most_failures = 1000;
  Lessons constant = training;
  constant.inputs.setConstant(0.3);
  CHECK(learn(start, constant, constant, {}, settings).stop == Stop::mu);
}

}  // namespace network_test
