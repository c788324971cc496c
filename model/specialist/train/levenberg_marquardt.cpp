// SPDX-License-Identifier: Apache-2.0
#include "model/specialist/train/levenberg_marquardt.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <utility>

#include "model/numeric/enum_name.hpp"
#include "model/specialist/train/limits.hpp"

namespace loopwarden::specialist {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd with_ones(const MatrixXd& m) {
  MatrixXd result(m.rows() + 1, m.cols());
  result.topRows(m.rows()) = m;
  result.bottomRows(1).setOnes();
  return result;
}

// Returns the products of rows i of a and k of b, case by case, k running fastest.
MatrixXd rowwise_products(const MatrixXd& a, const MatrixXd& b) {
  MatrixXd result(a.rows() * b.rows(), a.cols());
  for (Index i = 0; i < a.rows(); ++i) {
    result.middleRows(i * b.rows(), b.rows()) = b.array().rowwise() * a.row(i).array();
  }
  return result;
}

// The part of the normal equations that does not depend on mu. Unknowns of the hidden layers:
// neuron by neuron, its weights and then its bias, first layer first.
class NormalEquations {
 public:
  NormalEquations(const Network& network, const Lessons& lessons);

  double gradient_length() const;
  Network solve(double mu) const;

 private:
  Index first_size() const { return h1_ * a_; }
  Index second_size() const { return h2_ * b_; }

  NetworkShape shape_;
  Index h1_, h2_, a_, b_, c_;  // neurons; inputs with bias of layers 1, 2, 3
  MatrixXd v_;                 // last layer without bias
  MatrixXd hidden_;            // lower triangle, J'J of the hidden layers
  VectorXd hidden_gradient_;
  MatrixXd output_;           // z2 z2', the same for every output neuron
  MatrixXd output_gradient_;  // c_ x outputs
  MatrixXd coupling_;  // hidden unknowns x (h2, c): couples them to output o through v_(o, h2)
  double errors_;
};

NormalEquations::NormalEquations(const Network& network, const Lessons& lessons)
    : shape_(network.shape()),
      h1_(static_cast<Index>(shape_.first_hidden)),
      h2_(static_cast<Index>(shape_.second_hidden)),
      a_(static_cast<Index>(shape_.inputs) + 1),
      b_(h1_ + 1),
      c_(h2_ + 1),
      v_(network.layers[2].weights),
      errors_(static_cast<double>(lessons.targets.size())) {
  const MatrixXd& w2 = network.layers[1].weights;
  const MatrixXd x = with_ones(lessons.inputs);
  const MatrixXd z1 =
      ((network.layers[0].weights * lessons.inputs).colwise() + network.layers[0].bias)
          .array()
          .tanh();
  const MatrixXd z2 = ((w2 * z1).colwise() + network.layers[1].bias).array().tanh();
  const MatrixXd error = lessons.targets - ((v_ * z2).colwise() + network.layers[2].bias);
  const MatrixXd g1 = 1.0 - z1.array().square();
  const MatrixXd g2 = 1.0 - z2.array().square();
  const MatrixXd z1b = with_ones(z1);
  const MatrixXd z2b = with_ones(z2);

  // Gradient.
  output_gradient_ = z2b * error.transpose();
  const MatrixXd delta2 = (v_.transpose() * error).array() * g2.array();
  const MatrixXd delta1 = (w2.transpose() * delta2).array() * g1.array();
  const MatrixXd first = x * delta1.transpose();
  const MatrixXd second = z1b * delta2.transpose();
  hidden_gradient_.resize(first_size() + second_size());
  hidden_gradient_ << first.reshaped(), second.reshaped();

  // Case by case: the squared derivative of the output to the inputs of the neurons.
  const Index cases = x.cols();
  const MatrixXd m = v_.transpose() * v_;
  MatrixXd first_first(h1_ * h1_, cases);
  MatrixXd second_first(h2_ * h1_, cases);
  MatrixXd second_second(h2_ * h2_, cases);
  for (Index s = 0; s < cases; ++s) {
    const MatrixXd dd = g2.col(s).asDiagonal() * m * g2.col(s).asDiagonal();
    const MatrixXd dc = dd * w2 * g1.col(s).asDiagonal();
    const MatrixXd cc = g1.col(s).asDiagonal() * w2.transpose() * dc;
    first_first.col(s) = cc.reshaped();
    second_first.col(s) = dc.reshaped();
    second_second.col(s) = dd.reshaped();
  }
  const MatrixXd xx = rowwise_products(x, x);
  const MatrixXd zx = rowwise_products(x, z1b);  // row (a, b): x_a z1_b
  const MatrixXd zz = rowwise_products(z1b, z1b);
  const MatrixXd block11 = first_first * xx.transpose();   // (i', i) x (a, a')
  const MatrixXd block21 = second_first * zx.transpose();  // (i, k) x (a, b)
  const MatrixXd block22 = second_second * zz.transpose();
  hidden_.setZero(first_size() + second_size(), first_size() + second_size());
  for (Index i = 0; i < h1_; ++i) {
    for (Index p = 0; p <= i; ++p) {
      hidden_.block(i * a_, p * a_, a_, a_) = block11.row(p * h1_ + i).reshaped(a_, a_);
    }
    for (Index k = 0; k < h2_; ++k) {
      hidden_.block(first_size() + k * b_, i * a_, b_, a_) =
          block21.row(i * h2_ + k).reshaped(b_, a_);
    }
  }
  for (Index k = 0; k < h2_; ++k) {
    for (Index q = 0; q <= k; ++q) {
      hidden_.block(first_size() + k * b_, first_size() + q * b_, b_, b_) =
          block22.row(q * h2_ + k).reshaped(b_, b_);
    }
  }

  // Coupling to the output layer.
  output_ = z2b * z2b.transpose();
  const MatrixXd g2z2 = rowwise_products(g2, z2b);  // (k, c)
  const MatrixXd g1x = rowwise_products(g1, x);     // (i, a)
  coupling_.setZero(first_size() + second_size(), h2_ * c_);
  coupling_.topRows(first_size()) = g1x * g2z2.transpose();
  for (Index i = 0; i < h1_; ++i) {
    for (Index k = 0; k < h2_; ++k) coupling_.block(i * a_, k * c_, a_, c_) *= w2(k, i);
  }
  for (Index k = 0; k < h2_; ++k) {
    coupling_.block(first_size() + k * b_, k * c_, b_, c_) =
        z1b * g2z2.middleRows(k * c_, c_).transpose();
  }
}

double NormalEquations::gradient_length() const {
  return std::sqrt(hidden_gradient_.squaredNorm() + output_gradient_.squaredNorm()) / errors_;
}

Network NormalEquations::solve(double mu) const {
  MatrixXd output = output_;
  output.diagonal().array() += mu;
  const Eigen::LLT<MatrixXd> output_factor(output);
  MatrixXd m = v_.transpose() * v_;
  // V may have a lower rank than it has columns. A tiny ridge makes the root of its Gram matrix
  // possible.
  m.diagonal().array() += 1e-12 * (1.0 + m.diagonal().maxCoeff());
  const MatrixXd root = Eigen::LLT<MatrixXd>(m).matrixL();

  // Sum over the outputs of coupling, inverse, coupling', as a product with itself.
  MatrixXd whitened(coupling_.rows(), coupling_.cols());
  for (Index k = 0; k < h2_; ++k) {
    whitened.middleCols(k * c_, c_) =
        output_factor.matrixL().solve(coupling_.middleCols(k * c_, c_).transpose()).transpose();
  }
  MatrixXd mixed = MatrixXd::Zero(coupling_.rows(), coupling_.cols());
  for (Index l = 0; l < h2_; ++l) {
    for (Index k = l; k < h2_; ++k) {
      mixed.middleCols(l * c_, c_) += root(k, l) * whitened.middleCols(k * c_, c_);
    }
  }
  MatrixXd reduced = hidden_;
  reduced.diagonal().array() += mu;
  reduced.selfadjointView<Eigen::Lower>().rankUpdate(mixed, -1.0);

  const MatrixXd weighted = output_factor.solve(output_gradient_) * v_;  // c x h2
  const VectorXd right = hidden_gradient_ - coupling_ * weighted.reshaped();
  const VectorXd hidden = Eigen::LLT<Eigen::Ref<MatrixXd>, Eigen::Lower>(reduced).solve(right);
  const VectorXd along = coupling_.transpose() * hidden;
  const MatrixXd outputs =
      output_factor.solve(output_gradient_ - along.reshaped(c_, h2_) * v_.transpose());

  Network step(shape_);
  const auto first = hidden.head(first_size()).reshaped(a_, h1_);
  const auto second = hidden.tail(second_size()).reshaped(b_, h2_);
  step.layers[0].weights = first.topRows(a_ - 1).transpose();
  step.layers[0].bias = first.bottomRows(1).transpose();
  step.layers[1].weights = second.topRows(b_ - 1).transpose();
  step.layers[1].bias = second.bottomRows(1).transpose();
  step.layers[2].weights = outputs.topRows(c_ - 1).transpose();
  step.layers[2].bias = outputs.bottomRows(1).transpose();
  return step;
}

Network sum(const Network& a, const Network& b) {
  Network result = a;
  for (std::size_t i = 0; i < 3; ++i) {
    result.layers[i].weights += b.layers[i].weights;
    result.layers[i].bias += b.layers[i].bias;
  }
  return result;
}

}  // namespace

const char* to_text(Stop stop) noexcept {
  return numeric::enum_name<Stop::mu>(
      stop, {"epochs", "goal", "least gradient", "validation failures", "largest mu"});
}

double mean_square_error(const Network& network, const Lessons& lessons) {
  if (lessons.targets.size() == 0) return 0.0;
  return (lessons.targets - network.respond(lessons.inputs)).squaredNorm() /
         static_cast<double>(lessons.targets.size());
}

Learned learn(const Network& start, const Lessons& training, const Lessons& validation,
              const Lessons& test, const LearningSettings& settings,
              const std::function<void(std::size_t, const Epoch&)>& on_epoch) {
  Learned result{start, {}, 0, Stop::epochs};
  Network network = start;
  double mu = TrainLimits::kFirstMu;
  double training_error = mean_square_error(network, training);
  double least_validation = 0.0;
  std::size_t failures = 0;
  for (std::size_t epoch = 0;; ++epoch) {
    const NormalEquations normal(network, training);
    const Epoch now{training_error, mean_square_error(network, validation),
                    mean_square_error(network, test), normal.gradient_length(), mu};
    result.epochs.push_back(now);
    if (on_epoch) on_epoch(epoch, now);
    if (epoch == 0 || now.validation < least_validation) {
      least_validation = now.validation;
      result.best = epoch;
      result.network = network;
      failures = 0;
    } else {
      ++failures;
    }
    if (training_error <= settings.goal) return result.stop = Stop::goal, result;
    if (now.gradient <= settings.least_gradient) return result.stop = Stop::gradient, result;
    if (failures >= settings.most_failures) return result.stop = Stop::validation, result;
    if (epoch >= settings.most_epochs) return result;
    for (;;) {
      Network next = sum(network, normal.solve(mu));
      const double error = mean_square_error(next, training);
      if (error < training_error) {  // false for NaN as well
        network = std::move(next);
        training_error = error;
        mu *= 0.1;
        break;
      }
      mu *= 10.0;
      if (mu > TrainLimits::kLargestMu) return result.stop = Stop::mu, result;
    }
  }
}

}  // namespace loopwarden::specialist
