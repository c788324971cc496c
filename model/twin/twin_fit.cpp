// SPDX-License-Identifier: Apache-2.0
#include "model/twin/twin_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "model/gap/check.hpp"
#include "model/gap/model_run.hpp"

namespace loopwarden::twin {
namespace {

constexpr std::size_t kBlocks = 20;
constexpr double kStep = 0.02;  // of ln parameter

struct Parameter {
  const char* name;
  double plant::ProcessParameters::*value;
};

std::vector<Parameter> parameters_of(const plant::ProcessParameters& process) {
  std::vector<Parameter> out{{"gain", &plant::ProcessParameters::gain}};
  if (!process.integrating()) {
    out.push_back({"time_constant", &plant::ProcessParameters::time_constant_s});
  }
  if (process.dead_time_s > 0.0) {
    out.push_back({"dead_time", &plant::ProcessParameters::dead_time_s});
  }
  return out;
}

}  // namespace

plant::TwinFit twin_fit(const plant::LoopModel& twin, const numeric::LoopRecord& record) {
  const gap::CheckedRecord checked = gap::check(record, twin);
  plant::TwinFit out;
  if (!checked.quality.usable) return out;
  const std::vector<Parameter> parameters = parameters_of(twin.process);
  const auto count = static_cast<Eigen::Index>(parameters.size());
  const auto run = [&](const plant::LoopModel& model) {
    return gap::free_run(model, checked.co, checked.pv, checked.measured);
  };
  const std::vector<double> pv = run(checked.model);
  std::vector<std::vector<double>> slopes;
  for (const Parameter& p : parameters) {
    plant::LoopModel up = checked.model;
    plant::LoopModel down = checked.model;
    up.process.*p.value *= std::exp(kStep);
    down.process.*p.value *= std::exp(-kStep);
    std::vector<double> slope = run(up);
    const std::vector<double> below = run(down);
    for (std::size_t k = 0; k < slope.size(); ++k) slope[k] = (slope[k] - below[k]) / (2.0 * kStep);
    slopes.push_back(std::move(slope));
  }
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(count, count);
  Eigen::MatrixXd middle = Eigen::MatrixXd::Zero(count, count);
  const std::size_t block = std::max<std::size_t>(1, pv.size() / kBlocks);
  for (std::size_t begin = 0; begin < pv.size(); begin += block) {
    Eigen::VectorXd g = Eigen::VectorXd::Zero(count);
    for (std::size_t k = begin; k < std::min(pv.size(), begin + block); ++k) {
      if (!checked.used[k]) continue;
      Eigen::VectorXd row(count);
      for (Eigen::Index i = 0; i < count; ++i) row(i) = slopes[static_cast<std::size_t>(i)][k];
      normal += row * row.transpose();
      g += row * (checked.pv[k] - pv[k]);
    }
    middle += g * g.transpose();
  }
  normal.diagonal().array() += 1e-12 * normal.trace() + 1e-300;  // a direction that nothing touches
  const Eigen::MatrixXd inverse = normal.ldlt().solve(Eigen::MatrixXd::Identity(count, count));
  Eigen::MatrixXd covariance = inverse * middle * inverse;
  for (Eigen::Index i = 0; i < count; ++i) {
    const double variance = covariance(i, i);
    if (std::isfinite(variance) && variance <= kLargest) continue;
    covariance.row(i).setZero();
    covariance.col(i).setZero();
    covariance(i, i) = kLargest;
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    out.parameters.emplace_back(parameters[static_cast<std::size_t>(i)].name);
    out.covariance.emplace_back();
    for (Eigen::Index j = 0; j < count; ++j) {
      out.covariance.back().push_back(0.5 * (covariance(i, j) + covariance(j, i)));
    }
  }
  return out;
}

}  // namespace loopwarden::twin
