// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/excitation.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "model/numeric/statistics.hpp"

namespace loopwarden::analysis {
namespace {

constexpr std::size_t kLags = 3;
constexpr double kFeedbackShare = 0.3;
constexpr double kJump = 8.0;              // robust standard deviations
constexpr std::size_t kMostRows = 50'000;  // of a long record, evenly
constexpr double kRunsAway = 20.0;         // times the range of CO in the record

bool moves(std::span<const double> column) {
  return std::any_of(column.begin(), column.end(), [&](double v) { return v != column.front(); });
}

bool in_automatic(const LoopColumns& c, std::size_t k) {
  return c.automatic.empty() || c.automatic[k] > 0.5;
}

using Terms = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 10, 1>;

struct Regression {
  Eigen::VectorXd solved;
  Eigen::VectorXd left;
};

// What the move of CO at k may follow from: 1, a, c where SP moves, b.
Terms terms(const LoopColumns& c, std::size_t k, bool set_point_moves) {
  const Eigen::Index of_sp = set_point_moves ? 3 : 0;
  Terms t(7 + of_sp);
  t(0) = 1.0;
  for (std::size_t i = 0; i < kLags; ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    t(1 + at) = c.co[k - 1 - i] - c.co.front();
    if (set_point_moves) t(4 + at) = c.sp[k - i] - c.sp.front();
    t(4 + of_sp + at) = c.pv[k - i] - c.pv.front();
  }
  return t;
}

Regression regress(Eigen::MatrixXd columns, const Eigen::VectorXd& wanted) {
  Eigen::VectorXd scale = columns.colwise().norm();
  for (Eigen::Index i = 0; i < scale.size(); ++i) {
    scale(i) = scale(i) > 0.0 ? 1.0 / scale(i) : 0.0;
    columns.col(i) *= scale(i);
  }
  Regression r;
  const Eigen::VectorXd solved = columns.colPivHouseholderQr().solve(wanted);
  r.left = wanted - columns * solved;
  r.solved = solved.cwiseProduct(scale);
  return r;
}

}  // namespace

Feedback find_feedback(const LoopColumns& c) {
  Feedback f;
  f.set_point_moves = !c.sp.empty() && moves(c.sp);
  std::vector<std::size_t> rows;
  std::size_t automatic = 0;
  for (std::size_t k = kLags; k < c.co.size(); ++k) {
    if (!c.automatic.empty() && c.automatic[k] > 0.5) ++automatic;
    bool all = true;
    for (std::size_t i = 0; i <= kLags; ++i) all = all && in_automatic(c, k - i);
    if (all) rows.push_back(k);
  }
  constexpr std::size_t kFewest = 30;
  f.by_mode = automatic > 0;
  f.closed = f.by_mode;
  if (rows.size() < kFewest) return f;
  const std::size_t every = (rows.size() + kMostRows - 1) / kMostRows;
  const auto n = static_cast<Eigen::Index>((rows.size() + every - 1) / every);
  const Eigen::Index of_sp = f.set_point_moves ? 3 : 0;
  Eigen::MatrixXd columns(n, 7 + of_sp);
  Eigen::VectorXd u(n);
  for (Eigen::Index r = 0; r < n; ++r) {
    const std::size_t k = rows[static_cast<std::size_t>(r) * every];
    // Of differences from the value before, so that levels don't drown what is asked.
    u(r) = c.co[k] - c.co[k - 1];
    columns.row(r) = terms(c, k, f.set_point_moves).transpose();
  }
  // What jumps is left out of the law: a set point that is not in the record, a hand.
  Regression with = regress(columns, u);
  std::vector<double> sizes;
  for (const double left : with.left) sizes.push_back(std::abs(left));
  const double limit = kJump * numeric::kNormalOverMad * numeric::median(std::move(sizes));
  std::vector<Eigen::Index> calm;
  for (Eigen::Index r = 0; r < n; ++r) {
    if (std::abs(with.left(r)) <= limit) calm.push_back(r);
  }
  const Eigen::MatrixXd calm_columns = columns(calm, Eigen::all);
  const Eigen::VectorXd calm_u = u(calm);
  const Regression without = regress(calm_columns.leftCols(4 + of_sp), calm_u);
  const Regression law = regress(calm_columns, calm_u);
  const double before = without.left.squaredNorm();
  const Eigen::Index free = calm_u.size() - columns.cols();
  if (free > 0 && before > 1e-12 * calm_u.squaredNorm() && before > 0.0) {
    // Three terms explain something of any few rows: of the variances, not of the sums.
    const double left =
        law.left.squaredNorm() / before * static_cast<double>(free + 3) / static_cast<double>(free);
    f.explained = std::clamp(1.0 - left, 0.0, 1.0);
  }
  const Eigen::VectorXd& solved = c.sp.empty() ? law.solved : with.solved;
  f.closed = f.by_mode || (c.automatic.empty() && f.explained > kFeedbackShare);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    f.own[i] = solved(1 + at) + (i == 0 ? 1.0 : 0.0);
    if (f.set_point_moves) f.of_sp[i] = solved(4 + at);
    f.of_pv[i] = solved(4 + of_sp + at);
  }
  if (c.sp.empty()) {
    f.jumps.assign(c.co.size(), 0.0);
    for (const std::size_t k : rows) {
      const double left = c.co[k] - c.co[k - 1] - terms(c, k, f.set_point_moves).dot(solved);
      if (std::abs(left) > limit) f.jumps[k] = left;
    }
  }
  return f;
}

std::vector<double> outside_output(const LoopColumns& c, const Feedback& f,
                                   const plant::ProcessParameters& parameters, double period_s) {
  const std::size_t n = c.co.size();
  const auto [low, high] = std::minmax_element(c.co.begin(), c.co.end());
  const double far = kRunsAway * (*high - *low);
  plant::Process process(parameters, period_s);
  process.reset(0.0);
  std::vector<double> u(n, 0.0);
  std::vector<double> y(n, 0.0);
  for (std::size_t k = 0; k < n; ++k) {
    if (!in_automatic(c, k)) {
      u[k] = c.co[k] - c.co.front();
    } else if (k >= kLags) {
      double now = f.jumps.empty() ? 0.0 : f.jumps[k];
      for (std::size_t i = 0; i < 3; ++i) {
        now += f.own[i] * u[k - 1 - i] + f.of_pv[i] * y[k - i];
        if (f.set_point_moves) now += f.of_sp[i] * (c.sp[k - i] - c.sp.front());
      }
      u[k] = now;
    }
    if (!(std::abs(u[k]) <= far)) return {};
    if (k + 1 < n) y[k + 1] = process.step(u[k]);
  }
  return u;
}

PiGains find_pi_gains(const LoopColumns& c, double period_s) {
  PiGains gains;
  const auto [low, high] = std::minmax_element(c.co.begin(), c.co.end());
  std::vector<std::size_t> rows;
  for (std::size_t k = 1; k < c.co.size(); ++k) {
    const bool at_an_end = c.co[k] == *low || c.co[k] == *high;
    if (in_automatic(c, k) && in_automatic(c, k - 1) && !at_an_end) rows.push_back(k);
  }
  if (rows.size() < 10) return gains;
  const auto n = static_cast<Eigen::Index>(rows.size());
  const bool sp_known = !c.sp.empty();
  const auto sp = [&](std::size_t k) { return sp_known ? c.sp[k] : c.pv.front(); };
  Eigen::MatrixXd columns(n, sp_known ? 2 : 3);
  Eigen::VectorXd move(n);
  for (Eigen::Index r = 0; r < n; ++r) {
    const std::size_t k = rows[static_cast<std::size_t>(r)];
    const double e = sp(k) - c.pv[k];
    columns(r, 0) = e - (sp(k - 1) - c.pv[k - 1]);
    columns(r, 1) = e * period_s;
    if (!sp_known) columns(r, 2) = period_s;
    move(r) = c.co[k] - c.co[k - 1];
  }
  const Regression found = regress(columns, move);
  gains.kp = found.solved(0);
  gains.ki = found.solved(1);
  if (!sp_known && gains.ki != 0.0) gains.set_point = c.pv.front() + found.solved(2) / gains.ki;
  const double all = move.squaredNorm();
  gains.explained = all > 0.0 ? std::clamp(1.0 - found.left.squaredNorm() / all, 0.0, 1.0) : 0.0;
  return gains;
}

}  // namespace loopwarden::analysis
