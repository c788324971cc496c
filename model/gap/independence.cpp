// SPDX-License-Identifier: Apache-2.0
#include "model/gap/independence.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>

namespace loopwarden::gap {
namespace {

using Column = std::vector<double>;

constexpr std::size_t kLags = 4;             // of SP
constexpr std::size_t kCoLags = 3;           // of CO's part
constexpr std::size_t kMostOrder = 20;       // of the autoregression
constexpr std::size_t kSamplesANumber = 10;  // that is fitted, at least
constexpr double kRank = 1e-7;               // of the largest column; less is the others' sum

// Through one lag, from rest at its first value.
Column lagged(const Column& in, double keep) {
  Column out(in.size());
  double y = in.front();
  for (std::size_t k = 0; k < in.size(); ++k) {
    y = keep * y + (1.0 - keep) * in[k];
    out[k] = y;
  }
  return out;
}

void add_with_lags(Column first, std::size_t lags, double keep, std::vector<Column>& columns) {
  columns.push_back(std::move(first));
  for (std::size_t i = 0; i < lags; ++i) columns.push_back(lagged(columns.back(), keep));
}

// Upper quarter of a percent of chi-squared: four tests are made.
double chi_squared_limit(std::size_t freedom) {
  constexpr double kNormal = 2.807;
  const double part = 2.0 / (9.0 * static_cast<double>(freedom));
  const double root = 1.0 - part + kNormal * std::sqrt(part);
  return static_cast<double>(freedom) * root * root * root;
}

bool stands(const Column& sp, SampleRange stretch) {
  return std::all_of(sp.begin() + static_cast<std::ptrdiff_t>(stretch.begin),
                     sp.begin() + static_cast<std::ptrdiff_t>(stretch.end),
                     [&](double v) { return v == sp[stretch.begin]; });
}

// Samples of the stretch whose `order` samples before count too.
std::vector<std::size_t> rows_of(const LeftOver& d, std::size_t order) {
  std::vector<std::size_t> rows;
  std::size_t run = 0;
  for (std::size_t k = d.stretch.begin; k < d.stretch.end; ++k) {
    if (d.counts[k] && run >= order) rows.push_back(k);
    run = d.counts[k] ? run + 1 : 0;
  }
  return rows;
}

// The autoregression that makes a column white, and what it does to others.
class Whitener {
 public:
  Whitener(const Column& error, std::vector<std::size_t> rows, std::size_t order)
      : rows_(std::move(rows)), order_(static_cast<Eigen::Index>(order)) {
    Eigen::MatrixXd past(size(), order_ + 1);
    Eigen::VectorXd now(size());
    for (Eigen::Index i = 0; i < size(); ++i) {
      const std::size_t k = rows_[static_cast<std::size_t>(i)];
      now(i) = error[k];
      past(i, order_) = 1.0;
      for (Eigen::Index j = 0; j < order_; ++j)
        past(i, j) = error[k - 1 - static_cast<std::size_t>(j)];
    }
    coefficients_ = (past.transpose() * past).ldlt().solve(past.transpose() * now).head(order_);
  }

  Eigen::Index size() const noexcept { return static_cast<Eigen::Index>(rows_.size()); }

  Eigen::VectorXd operator()(const Column& in) const {
    Eigen::VectorXd out(size());
    for (Eigen::Index i = 0; i < size(); ++i) {
      const std::size_t k = rows_[static_cast<std::size_t>(i)];
      double v = in[k];
      for (Eigen::Index j = 0; j < order_; ++j) {
        v -= coefficients_(j) * in[k - 1 - static_cast<std::size_t>(j)];
      }
      out(i) = v;
    }
    out.array() -= out.mean();
    return out;
  }

 private:
  std::vector<std::size_t> rows_;
  Eigen::Index order_;
  Eigen::VectorXd coefficients_;
};

struct Answer {
  bool stands_out = false;
  double rms = 0.0;  // PV units, of what follows the columns
};

Answer answer_to(const std::vector<Column>& columns, const LeftOver& d, const Whitener& whiten) {
  const Eigen::VectorXd error = whiten(d.error);
  Eigen::MatrixXd white(whiten.size(), static_cast<Eigen::Index>(columns.size()));
  Eigen::VectorXd unit(white.cols());
  for (Eigen::Index i = 0; i < white.cols(); ++i) {
    white.col(i) = whiten(columns[static_cast<std::size_t>(i)]);
    const double size = white.col(i).norm();
    unit(i) = size > 0.0 ? 1.0 / size : 0.0;
    white.col(i) *= unit(i);
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver;
  solver.setThreshold(kRank);
  solver.compute(white);
  const auto rank = static_cast<std::size_t>(solver.rank());
  if (rank == 0) return {};
  const Eigen::VectorXd c = solver.solve(error);
  const double left = (error - white * c).squaredNorm();
  const double explained = error.squaredNorm() - left;
  const double freedom = static_cast<double>(whiten.size()) - static_cast<double>(rank);
  Answer answer;
  answer.stands_out = explained > chi_squared_limit(rank) * left / freedom;
  double sum = 0.0;
  double squares = 0.0;
  for (std::size_t k = d.stretch.begin; k < d.stretch.end; ++k) {
    double v = 0.0;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      v += c(at) * unit(at) * columns[i][k];
    }
    sum += v;
    squares += v * v;
  }
  const auto n = static_cast<double>(d.stretch.end - d.stretch.begin);
  answer.rms = std::sqrt(std::max(0.0, squares / n - (sum / n) * (sum / n)));
  return answer;
}

// Whether all that is left would stand out in every second case or more, if it were an answer to SP
// of the shape of `column`.
bool would_stand_out(const Column& column, const LeftOver& d, const Whitener& whiten,
                     std::size_t freedom) {
  const double noise = whiten(d.error).squaredNorm() / static_cast<double>(whiten.size());
  const auto n = static_cast<double>(d.stretch.end - d.stretch.begin);
  double sum = 0.0;
  double squares = 0.0;
  for (std::size_t k = d.stretch.begin; k < d.stretch.end; ++k) {
    sum += column[k];
    squares += column[k] * column[k];
  }
  const double variance = squares / n - (sum / n) * (sum / n);
  if (!(variance > 0.0)) return false;
  // PV answers to SP by no more than SP's own moves.
  const double size = std::min(1.0, d.left_rms * d.left_rms / variance);
  const double seen = whiten(column).squaredNorm() * size / noise;
  // The mean of what the test would show is that and its freedom.
  return seen + static_cast<double>(freedom) > chi_squared_limit(freedom);
}

// CO as far as it follows the columns of SP.
Column following_part(const Column& co, const std::vector<Column>& columns) {
  Eigen::MatrixXd x(static_cast<Eigen::Index>(co.size()),
                    static_cast<Eigen::Index>(columns.size()) + 1);
  x.rightCols(1).setOnes();
  for (std::size_t i = 0; i < columns.size(); ++i) {
    x.col(static_cast<Eigen::Index>(i)) =
        Eigen::Map<const Eigen::VectorXd>(columns[i].data(), x.rows());
  }
  const Eigen::Map<const Eigen::VectorXd> y(co.data(), x.rows());
  const Eigen::VectorXd part = x * x.colPivHouseholderQr().solve(y);
  return {part.data(), part.data() + part.size()};
}

}  // namespace

Independence test_independence(const LeftOver& d) {
  Independence out;
  if (!(d.left_rms > d.nothing_rms)) {
    out.tested = true;
    return out;
  }
  if (d.sp.empty()) {
    out.why_not = "SP is not known";
    return out;
  }
  const double lag_s = 0.5 * std::max(d.answer_s, 2.0 * d.period_s);
  if (stands(d.sp, d.stretch)) {
    out.why_not = "SP is constant there";
    return out;
  }
  const double keep = std::exp(-d.period_s / lag_s);
  std::vector<Column> straight;
  add_with_lags(d.sp, kLags, keep, straight);
  double mean = 0.0;
  for (const double v : d.sp) mean += v / static_cast<double>(d.sp.size());
  Column square(d.sp.size());
  Column size(d.sp.size(), 0.0);
  for (std::size_t k = 0; k < d.sp.size(); ++k) {
    square[k] = (d.sp[k] - mean) * (d.sp[k] - mean);
    if (k > 0) size[k] = std::abs(d.sp[k] - d.sp[k - 1]);
  }
  std::vector<Column> bent;
  add_with_lags(std::move(square), kLags, keep, bent);
  std::vector<Column> alike;
  add_with_lags(std::move(size), kLags, keep, alike);

  const std::size_t length = d.stretch.end - d.stretch.begin;
  const std::size_t order = std::min(kMostOrder, length / (4 * kSamplesANumber));
  std::vector<std::size_t> rows = rows_of(d, order);
  if (order == 0 || rows.size() < kSamplesANumber * (order + straight.size())) {
    out.why_not = "it has too few samples";
    return out;
  }
  const Whitener whiten(d.error, std::move(rows), order);
  if (!would_stand_out(straight[1], d, whiten, straight.size())) {
    out.why_not = "SP moves too little there";
    return out;
  }
  out.tested = true;
  const auto take = [&](const Answer& answer) {
    const bool follows = answer.stands_out && answer.rms > d.matters_rms;
    if (follows) out.follows_rms = std::max(out.follows_rms, std::min(answer.rms, d.left_rms));
    return follows;
  };
  for (const std::vector<Column>* columns : {&straight, &bent, &alike}) {
    out.follows_sp = take(answer_to(*columns, d, whiten)) || out.follows_sp;
  }
  if (d.co.empty()) return out;
  std::vector<Column> of_co;
  add_with_lags(following_part(d.co, straight), kCoLags, keep, of_co);
  out.follows_co = take(answer_to(of_co, d, whiten));
  return out;
}

}  // namespace loopwarden::gap
