// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/starts.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace loopwarden::estimator {
namespace {

constexpr std::size_t kPoints = 500;  // of the record, in a scan

// Positions of one searched parameter. A period is spread evenly in frequency, four per line of
// the spectrum.
std::vector<double> places(const effects::SearchRange& range, double duration_s,
                           std::size_t count) {
  std::vector<double> out;
  if (range.is_period) {
    const double low = 1.0 / range.high;
    const double high = 1.0 / range.low;
    const auto lines =
        static_cast<std::size_t>(std::clamp(4.0 * (high - low) * duration_s, 20.0, 1500.0));
    for (std::size_t i = 0; i < lines; ++i) {
      const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(lines);
      out.push_back(range.position(1.0 / (low + (high - low) * share)));
    }
    return out;
  }
  for (std::size_t i = 0; i < count; ++i) {
    out.push_back((static_cast<double>(i) + 0.5) / static_cast<double>(count));
  }
  return out;
}

}  // namespace

std::optional<std::vector<double>> scan(const Candidate& candidate, const Blocks& blocks,
                                        std::span<const double> error, const ErrorFilter* filter) {
  if (candidate.columns == 0 || candidate.fill == nullptr) return std::nullopt;
  if (candidate.search.empty() || candidate.search.size() > 2) return std::nullopt;
  const std::size_t stride =
      filter != nullptr ? 1 : std::max<std::size_t>(1, blocks.count() / kPoints);
  std::vector<double> target(error.begin(), error.end());
  if (filter != nullptr) filter->whiten(error, target);
  const std::size_t points = blocks.count() / stride;
  const double duration_s = blocks.duration_s();
  const bool two = candidate.search.size() == 2;
  const std::vector<double> first = places(candidate.search[0], duration_s, two ? 48 : 240);
  const std::vector<double> second =
      two ? places(candidate.search[1], duration_s, candidate.search[0].is_period ? 6 : 12)
          : std::vector<double>{0.0};

  const auto size = static_cast<Eigen::Index>(candidate.columns) + 1;
  std::vector<std::vector<double>> columns(candidate.columns);
  double best = std::numeric_limits<double>::infinity();
  std::vector<double> found;
  for (const double a : first) {
    for (const double b : second) {
      std::vector<double> z{a};
      if (two) z.push_back(b);
      std::vector<double> values;
      for (std::size_t i = 0; i < z.size(); ++i) {
        values.push_back(candidate.search[i].value(z[i]));
      }
      for (auto& column : columns) column.assign(points, 1.0);
      candidate.fill(values, blocks.period_s() * static_cast<double>(stride), columns);
      for (std::size_t i = 0; filter != nullptr && i < columns.size(); ++i) {
        const std::vector<double> column = columns[i];
        filter->whiten(column, columns[i]);
      }
      Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(size, size);
      Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
      double square = 0.0;
      Eigen::VectorXd row(size);
      row(size - 1) = 1.0;
      for (std::size_t k = 0; k < points; ++k) {
        if (!(blocks.variance()[k * stride] > 0.0)) continue;
        for (std::size_t i = 0; i < columns.size(); ++i) {
          row(static_cast<Eigen::Index>(i)) = columns[i][k];
        }
        const double e = target[k * stride];
        normal.noalias() += row * row.transpose();
        right += e * row;
        square += e * e;
      }
      normal.diagonal().array() += 1e-9;
      const double left = square - right.dot(normal.ldlt().solve(right));
      if (left < best) {
        best = left;
        found = z;
      }
    }
  }
  return found;
}

std::optional<std::vector<double>> sticking_start(const Candidate& candidate, const Slips& slips) {
  if (!candidate.slips || slips.count < 3 || slips.static_friction <= 0.0) return std::nullopt;
  // fs = (s + j) / 2, and a slip takes the force from fs to `remaining` fs; a stem with little
  // damping overshoots by most of the jump.
  constexpr double kOvershoot = 0.5;
  const double fs = slips.static_friction;
  const double j = std::clamp(fs * (1.0 - slips.remaining) / (1.0 + kOvershoot), 0.0, fs);
  const double s = 2.0 * fs - j;
  return std::vector<double>{std::clamp(candidate.search[0].position(s), 0.0, 1.0),
                             std::clamp(candidate.search[1].position(j / s), 0.0, 1.0)};
}

}  // namespace loopwarden::estimator
