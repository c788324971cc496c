// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/test_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/estimator/constants.hpp"

namespace loopwarden::estimator {
namespace {

constexpr double kReturns_s = 300.0;  // of the disturbance

double answer_of(const plant::LoopModel& model) {
  return std::max(plant::answer_s(model), model.sample_time_s);
}

Blocks blocks_of(const plant::LoopModel& model, const std::vector<double>& co, double noise_rms) {
  const std::size_t count = co.size();
  const Observed observed{model.sample_time_s, co, std::vector<double>(count, 0.0),
                          std::vector<bool>(count, true)};
  return {observed, count, block_length(model.process.time_constant_s, model.sample_time_s, count),
          std::max(noise_rms, kLimits.least_noise * model.transmitter.span())};
}

std::vector<double> variance_of(const plant::LoopModel& model, const Blocks& blocks,
                                const std::vector<double>& co, double law_error) {
  std::vector<double> variance = activity(blocks, co, model.process.dead_time_s, answer_of(model));
  for (double& v : variance) v *= law_error * law_error;
  return variance;
}

}  // namespace

TestEvidence::TestEvidence(const plant::LoopModel& model, const std::vector<double>& co,
                           std::size_t before, double noise_rms, double disturbance,
                           double law_error)
    : before_(before),
      blocks_(blocks_of(model, co, noise_rms)),
      filter_(blocks_, {kReturns_s, answer_of(model)}, disturbance,
              variance_of(model, blocks_, co, law_error)) {}

double TestEvidence::log_likelihood(std::vector<double> error) const {
  double level = 0.0;
  for (std::size_t k = 0; k < before_; ++k) level += error[k] / static_cast<double>(before_);
  for (double& e : error) e -= level;
  std::vector<double> by_block(blocks_.count());
  std::vector<double> white(blocks_.count());
  blocks_.average(error, by_block);
  filter_.whiten(by_block, white);
  // The filter begins without a disturbance, so its first innovations only find the present one.
  double sum = 0.0;
  for (std::size_t b = before_ / 2 / blocks_.per_block(); b < white.size(); ++b) {
    sum -= 0.5 * white[b] * white[b];
  }
  return sum;
}

double log_mean(const std::vector<double>& log_values) {
  const double top = *std::max_element(log_values.begin(), log_values.end());
  double sum = 0.0;
  for (const double l : log_values) sum += std::exp(l - top);
  return top + std::log(sum / static_cast<double>(log_values.size()));
}

}  // namespace loopwarden::estimator
