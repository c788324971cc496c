// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/likelihood.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "model/estimator/constants.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::estimator {
namespace {

std::vector<double> prior_deviations(const LoopFacts& loop, std::size_t fixed) {
  const plant::LoopModel& model = loop.model;
  const plant::ProcessUncertainty& unknown = model.uncertainty;
  const double part = kLimits.uncertainty;
  std::vector<double> prior{
      part * unknown.gain,
      loop.wide ? 0.5 * kLimits.uncertainty * 0.2 : part * unknown.time_constant,
      loop.wide ? 0.1 * model.process.dead_time_s
                : std::max(part * unknown.dead_time * model.process.dead_time_s,
                           part * model.sample_time_s)};
  // A model that states no level means PV 0 at CO 0.
  prior.push_back(!loop.wide && !model.process.integrating()
                      ? std::hypot(kLimits.level * std::abs(model.process.gain) * loop.co_span,
                                   loop.level_deviation)
                      : kLimits.free_level * loop.pv_span);
  const bool integrating = model.process.integrating();
  for (std::size_t i = 1; i < fixed; ++i) {
    prior.push_back((i == 1 && integrating ? 10.0 : kLimits.start) * loop.pv_span);
  }
  return prior;
}

}  // namespace

std::vector<std::vector<double>> Solution::solved(const Hypothesis& hypothesis,
                                                  std::size_t fixed) const {
  std::vector<std::vector<double>> out;
  auto next = static_cast<Eigen::Index>(Columns::kFirstFixed + fixed);
  for (const Law* term : hypothesis.terms()) {
    std::vector<double>& values = out.emplace_back();
    if (term->solves_gain) values.push_back(gain());
    for (std::size_t i = 0; i < term->columns; ++i) values.push_back(mean(next++));
  }
  return out;
}

Likelihood::Likelihood(const LoopFacts& loop, const LoopRun& run, const Observed& observed,
                       std::size_t samples, double noise_rms, const Slips& slips)
    : loop_(loop),
      run_(run),
      noise_rms_(noise_rms),
      blocks_(observed, samples,
              block_length(loop.model.process.time_constant_s * (loop.wide ? 0.5 : 1.0),
                           observed.period_s, samples),
              noise_rms),
      errors_(blocks_,
              {.returns_s = std::max(blocks_.duration_s(), 20.0 * loop.answer_s),
               .answer_s = loop.answer_s},
              loop.pv_span,
              activity(blocks_, observed.co, loop.model.process.dead_time_s, loop.answer_s)),
      slips_(slips),
      pv_(blocks_.pv()) {
  std::vector<double> offset(blocks_.count());
  blocks_.average(run.offset(), offset);
  for (std::size_t k = 0; k < pv_.size(); ++k) pv_[k] -= offset[k];
  for (const std::vector<double>& column : run.fixed()) {
    blocks_.average(column, fixed_.emplace_back(blocks_.count()));
  }
  prior_ = prior_deviations(loop, fixed_.size());
  const auto n = static_cast<Eigen::Index>(blocks_.count());
  for (std::size_t i = 0; i < errors_.size(); ++i) {
    White& white = white_.emplace_back();
    white.columns.resize(n, static_cast<Eigen::Index>(fixed_.size()) + 1);
    const auto into = [&](const std::vector<double>& in, std::size_t column) {
      errors_.at(i).whiten(
          in, {white.columns.col(static_cast<Eigen::Index>(column)).data(), in.size()});
    };
    for (std::size_t c = 0; c < fixed_.size(); ++c) into(fixed_[c], c);
    into(pv_, fixed_.size());
  }
}

double Likelihood::prior_of(const Hypothesis& hypothesis, std::size_t column) const noexcept {
  if (column == 0 && hypothesis.changes_gain()) return std::max(kLimits.changed_gain, prior_[0]);
  return prior_[column];
}

// A jump of the law at another moment than that of the stem.
void Likelihood::add_jumps(const Point& point, const std::vector<double>& stem,
                           std::vector<double>& variance) const {
  const double h = blocks_.sample_time_s();
  const double gain = loop_.model.process.gain;
  const auto around =
      std::max<std::ptrdiff_t>(1, static_cast<std::ptrdiff_t>(0.6 * loop_.answer_s / h + 1e-6));
  const auto delay = static_cast<std::ptrdiff_t>(loop_.model.process.dead_time_s / h + 1e-6);
  const auto last = static_cast<std::ptrdiff_t>(stem.size()) - 1;
  for (std::size_t b = 0; b < variance.size(); ++b) {
    const auto at = static_cast<std::ptrdiff_t>((static_cast<double>(b) + 0.5) *
                                                static_cast<double>(blocks_.per_block())) -
                    delay;
    const double moved =
        stem[static_cast<std::size_t>(std::clamp(at + around, std::ptrdiff_t{0}, last))] -
        stem[static_cast<std::size_t>(std::clamp(at - around, std::ptrdiff_t{0}, last))];
    variance[b] = point.jitter * point.jitter * gain * gain * moved * moved;
  }
}

double Likelihood::of(const Hypothesis& hypothesis, std::span<const double> z, Work& work,
                      Solution* solution) const {
  ++work.evaluations;
  const Point point = hypothesis.at(z);
  const bool guided = hypothesis.sticking() != Hypothesis::npos && point.jitter > 0.0;
  const bool jitters = hypothesis.jumps() && point.jitter > 0.0;
  const std::size_t samples = blocks_.samples();
  double penalty = 0.0;
  try {
    penalty = run_.run(hypothesis, point, samples, guided ? &slips_ : nullptr, work.columns,
                       jitters ? &work.stem : nullptr);
  } catch (const effects::EffectError&) {
    return -1e12;  // outside what the law accepts
  }

  // Means over blocks.
  std::size_t count = Columns::kFirstFixed;
  std::vector<double> solved_rms;  // at every sample: blocks average high frequencies away
  const auto mean_of = [&](const std::vector<double>& signal, std::size_t at) {
    if (work.means.size() <= at) work.means.resize(at + 1);
    work.means[at].resize(blocks_.count());
    blocks_.average(signal, work.means[at]);
  };
  for (std::size_t i = 0; i < Columns::kFirstFixed; ++i) mean_of(work.columns[i], i);
  for (std::size_t i = 0; i < hypothesis.terms().size(); ++i) {
    if (hypothesis.terms()[i]->columns == 0) continue;
    run_.solved(hypothesis, point, i, samples, work.solved);
    for (const auto& column : work.solved) {
      solved_rms.push_back(numeric::rms(column));
      mean_of(column, count++);
    }
  }

  const std::size_t named = count;
  if (work.extra != nullptr) {
    for (const auto& signal : work.extra->signals) mean_of(signal, count++);
  }

  // Order in `white`: moving columns, fixed ones, PV.
  const std::size_t index = errors_.index(point.disturbance, point.law);
  const std::size_t fixed = fixed_.size();
  const auto n = static_cast<Eigen::Index>(blocks_.count());
  const auto size = static_cast<Eigen::Index>(count + fixed);
  work.white.resize(n, size + 1);
  std::vector<const double*> in;
  for (std::size_t i = 0; i < count; ++i) in.push_back(work.means[i].data());
  const ErrorFilter* filter = &errors_.at(index);
  std::optional<ErrorFilter> own;
  if (jitters) {
    std::vector<double> variance(blocks_.count());
    add_jumps(point, work.stem, variance);
    own = errors_.with_jumps(index, variance);
    filter = &*own;
    for (const auto& column : fixed_) in.push_back(column.data());
    in.push_back(pv_.data());
  }
  for (std::size_t i = 0; i < in.size(); i += 4) {
    const double* from[4];
    double* to[4];
    for (std::size_t j = 0; j < 4; ++j) {
      const std::size_t column = std::min(i + j, in.size() - 1);
      from[j] = in[column];
      to[j] = work.white.col(static_cast<Eigen::Index>(column)).data();
    }
    filter->whiten_four(from, to);
  }
  if (!jitters) work.white.rightCols(white_[index].columns.cols()) = white_[index].columns;

  // K' counts from 1.
  work.white.col(size) -= work.white.col(0);
  Eigen::MatrixXd gram(size + 1, size + 1);
  gram.setZero();
  gram.selfadjointView<Eigen::Lower>().rankUpdate(work.white.transpose());
  Eigen::VectorXd prior(size);
  for (std::size_t i = 0; i < Columns::kFirstFixed; ++i) {
    prior(static_cast<Eigen::Index>(i)) = prior_of(hypothesis, i);
  }
  for (std::size_t i = Columns::kFirstFixed; i < count; ++i) {
    prior(static_cast<Eigen::Index>(i)) =
        i >= named
            ? work.extra->deviations[i - named]
            : kLimits.solved * loop_.pv_span / std::max(solved_rms[i - Columns::kFirstFixed], 1e-9);
  }
  for (std::size_t i = 0; i < fixed; ++i) {
    prior(static_cast<Eigen::Index>(count + i)) = prior_[Columns::kFirstFixed + i];
  }
  Eigen::MatrixXd q = gram.topLeftCorner(size, size).selfadjointView<Eigen::Lower>();
  q = prior.asDiagonal() * q * prior.asDiagonal();
  q.diagonal().array() += 1.0;
  const Eigen::VectorXd v = prior.cwiseProduct(gram.row(size).head(size).transpose());
  const Eigen::LLT<Eigen::MatrixXd> factor(q);
  const Eigen::VectorXd weights = factor.solve(v);
  double log_det = 0.0;
  for (Eigen::Index i = 0; i < size; ++i) log_det += 2.0 * std::log(factor.matrixLLT()(i, i));
  double log_likelihood =
      -0.5 * (gram(size, size) - v.dot(weights) + log_det + filter->log_determinant()) - penalty;
  if (!std::isfinite(log_likelihood)) log_likelihood = -1e12;
  if (solution == nullptr) return log_likelihood;

  // Moving columns of the effects come after the fixed ones in the solution.
  const Eigen::VectorXd mean = prior.cwiseProduct(weights);
  const Eigen::MatrixXd covariance =
      prior.asDiagonal() * factor.solve(Eigen::MatrixXd::Identity(size, size)) * prior.asDiagonal();
  std::vector<Eigen::Index> order;
  for (std::size_t i = 0; i < Columns::kFirstFixed; ++i)
    order.push_back(static_cast<Eigen::Index>(i));
  for (std::size_t i = count; i < count + fixed; ++i) order.push_back(static_cast<Eigen::Index>(i));
  for (std::size_t i = Columns::kFirstFixed; i < count; ++i)
    order.push_back(static_cast<Eigen::Index>(i));
  solution->log_likelihood = log_likelihood;
  solution->mean.resize(size);
  solution->covariance.resize(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    solution->mean(i) = mean(order[static_cast<std::size_t>(i)]);
    for (Eigen::Index j = 0; j < size; ++j) {
      solution->covariance(i, j) =
          covariance(order[static_cast<std::size_t>(i)], order[static_cast<std::size_t>(j)]);
    }
  }
  solution->design.resize(n, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    solution->design.col(i) = work.white.col(order[static_cast<std::size_t>(i)]);
  }
  solution->innovations = work.white.col(size) - work.white.leftCols(size) * mean;
  solution->log_scales = filter->log_scales();
  return log_likelihood;
}

std::vector<double> Likelihood::simulate(const Hypothesis& hypothesis, std::span<const double> z,
                                         const Solution& solution, std::size_t samples,
                                         const Extra* extra, const Slips* slips) const {
  const Point point = hypothesis.at(z);
  std::vector<double> columns[3];
  run_.run(hypothesis, point, samples, slips, columns, nullptr);
  std::vector<double> pv(samples);
  for (std::size_t k = 0; k < samples; ++k) {
    pv[k] = run_.offset()[k] + solution.gain() * columns[0][k] + solution.mean(1) * columns[1][k] +
            solution.mean(2) * columns[2][k];
  }
  auto next = static_cast<Eigen::Index>(Columns::kFirstFixed);
  for (const auto& column : run_.fixed()) {
    for (std::size_t k = 0; k < samples; ++k) pv[k] += solution.mean(next) * column[k];
    ++next;
  }
  std::vector<std::vector<double>> solved;
  for (std::size_t i = 0; i < hypothesis.terms().size(); ++i) {
    if (hypothesis.terms()[i]->columns == 0) continue;
    run_.solved(hypothesis, point, i, samples, solved);
    for (const auto& column : solved) {
      for (std::size_t k = 0; k < samples; ++k) pv[k] += solution.mean(next) * column[k];
      ++next;
    }
  }
  for (std::size_t i = 0; extra != nullptr && i < extra->signals.size(); ++i, ++next) {
    for (std::size_t k = 0; k < samples; ++k) pv[k] += solution.mean(next) * extra->signals[i][k];
  }
  return pv;
}

}  // namespace loopwarden::estimator
