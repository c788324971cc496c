// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/judgement.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <string_view>

#include "model/estimator/constants.hpp"
#include "model/numeric/random.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::estimator {
namespace {

using numeric::Random;

constexpr double kLargestFactor = 3.0;  // logarithm

// The score of a fit by parts of the record. All parts share the penalty equally.
std::vector<double> score_of_parts(const Fit& fit) {
  std::vector<double> parts = parts_of(fit.solution);
  double sum = 0.0;
  for (const double v : parts) sum += v;
  for (double& v : parts) v += (fit.score - sum) / static_cast<double>(kLimits.parts);
  return parts;
}

// Relative error of a parameter by the law itself.
double law_missing(std::string_view parameter) {
  const auto is_one = [&](std::initializer_list<std::string_view> names) {
    return std::find(names.begin(), names.end(), parameter) != names.end();
  };
  if (is_one({"s", "damping"})) return kLimits.missing_size;
  if (is_one({"j", "width", "lag"})) return kLimits.missing_shape;
  if (is_one({"natural_frequency", "time_constant", "seconds"})) {
    return kLimits.missing_times;
  }
  return kLimits.missing_other;
}

// A draw from N(mean, covariance).
Eigen::VectorXd draw(const Eigen::VectorXd& mean, const Eigen::MatrixXd& covariance,
                     Random& random) {
  Eigen::VectorXd normal(mean.size());
  for (Eigen::Index i = 0; i < normal.size(); ++i) normal(i) = random.normal();
  const Eigen::LDLT<Eigen::MatrixXd> factor(covariance);
  const Eigen::VectorXd scale = factor.vectorD().cwiseMax(0.0).cwiseSqrt();
  Eigen::VectorXd out = factor.matrixL() * scale.cwiseProduct(normal).eval();
  out = factor.transpositionsP().transpose() * out;
  return mean + out;
}

}  // namespace

std::vector<double> parts_of(const Solution& solution) {
  std::vector<double> parts(kLimits.parts, 0.0);
  const auto count = static_cast<std::size_t>(solution.innovations.size());
  for (std::size_t k = 0; k < count; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    parts[k * kLimits.parts / count] -=
        0.5 * solution.innovations(i) * solution.innovations(i) + solution.log_scales(i);
  }
  return parts;
}

double lead_t(const Fit& more, const Fit& less) {
  std::vector<double> lead = score_of_parts(more);
  const std::vector<double> other = score_of_parts(less);
  for (std::size_t b = 0; b < lead.size(); ++b) lead[b] -= other[b];
  const auto count = static_cast<double>(lead.size());
  const double deviation = numeric::deviation(lead) * std::sqrt(count / (count - 1.0));
  return deviation > 0.0 ? numeric::mean(lead) * std::sqrt(count) / deviation : 0.0;
}

std::vector<double> weights(const std::vector<Fit>& fits) {
  std::vector<std::vector<double>> parts;
  for (const Fit& fit : fits) parts.push_back(score_of_parts(fit));
  std::vector<double> weight(fits.size(), 0.0);
  Random random(1);
  std::vector<double> score(fits.size());
  for (std::size_t d = 0; d < kLimits.draws; ++d) {
    std::vector<double> share(kLimits.parts);
    double sum = 0.0;
    for (double& g : share) sum += g = -std::log(random.uniform());
    for (double& g : share) g *= static_cast<double>(kLimits.parts) / sum;
    double top = -1e300;
    for (std::size_t h = 0; h < fits.size(); ++h) {
      score[h] = 0.0;
      for (std::size_t b = 0; b < kLimits.parts; ++b) score[h] += share[b] * parts[h][b];
      top = std::max(top, score[h]);
    }
    double total = 0.0;
    for (double& s : score) total += s = std::exp(s - top);
    for (std::size_t h = 0; h < fits.size(); ++h) {
      weight[h] += score[h] / total / static_cast<double>(kLimits.draws);
    }
  }
  return weight;
}

std::vector<std::map<std::string, Interval>> intervals(const Likelihood& likelihood, const Fit& fit,
                                                       const Fit& shown) {
  const Terms& terms = fit.hypothesis.terms();
  std::vector<std::map<std::string, std::vector<double>>> samples(terms.size());
  std::vector<std::vector<double>> parts;
  Random random(7);
  Likelihood::Work work;
  for (const Member& member : fit.population.members) {
    Solution solution;
    likelihood.of(fit.hypothesis, member.z, work, &solution);
    if (solution.mean.size() == 0) continue;
    const Eigen::VectorXd drawn = draw(solution.mean, solution.covariance, random);
    solution.innovations -= solution.design * (drawn - solution.mean);
    solution.mean = drawn;
    parts.push_back(parts_of(solution));
    const Point point = fit.hypothesis.at(member.z);
    const auto solved = solution.solved(fit.hypothesis, likelihood.fixed());
    for (std::size_t i = 0; i < terms.size(); ++i) {
      for (const auto& [name, value] : terms[i]->effect(point.searched[i], solved[i]).parameters) {
        samples[i][name].push_back(value);
      }
    }
  }
  const Point point = shown.hypothesis.at(shown.population.top().z);
  const auto shown_solved = shown.solution.solved(shown.hypothesis, likelihood.fixed());
  std::vector<std::map<std::string, Interval>> out(terms.size());
  const auto count = static_cast<double>(parts.size());
  const auto part_count = static_cast<double>(kLimits.parts);
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const auto spec = terms[i]->effect(point.searched[i], shown_solved[i]);
    for (auto& [name, values] : samples[i]) {
      const auto value = spec.parameters.find(name);
      if (value == spec.parameters.end() || values.size() != parts.size()) continue;
      const double mean = numeric::mean(values);
      std::vector<double> influence(kLimits.parts, 0.0);
      double sum = 0.0;
      for (std::size_t b = 0; b < kLimits.parts; ++b) {
        double l = 0.0;
        for (const auto& part : parts) l += part[b] / count;
        for (std::size_t m = 0; m < parts.size(); ++m) {
          influence[b] += (values[m] - mean) * (parts[m][b] - l) / count;
        }
        sum += influence[b];
      }
      double square = 0.0;
      for (const double v : influence) {
        square += (v - sum / part_count) * (v - sum / part_count);
      }
      const double of_records = square * part_count / (part_count - 1.0);
      double variance = std::max(numeric::variance(values), of_records);
      // The gain of the model is uncertain, too, and so is the law.
      if (terms[i]->solves_gain) {
        variance += std::pow(likelihood.allowed(0) * value->second, 2.0);
      }
      variance += std::pow(law_missing(name) * value->second, 2.0);
      const double half = 1.96 * std::sqrt(variance);
      Interval& interval =
          out[i][name] = {value->second, {value->second - half, value->second + half}};
      // The shape of a law errs by a factor.
      if (law_missing(name) == kLimits.missing_shape && value->second > 0.0) {
        const double factor = std::exp(std::min(half / value->second, kLargestFactor));
        interval.within = {value->second / factor, value->second * factor};
      }
    }
    // A slip jump is at most the stick band.
    const auto band = out[i].find("s");
    const auto jump = out[i].find("j");
    if (band != out[i].end() && jump != out[i].end()) {
      double& highest = jump->second.within[1];
      highest = std::max(jump->second.value, std::min(highest, band->second.within[1]));
    }
  }
  return out;
}

}  // namespace loopwarden::estimator
