// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/likelihood.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "model/estimator/constants.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::estimator {
namespace {

constexpr double kImpossible = -1e12;  // nats
constexpr int kBentRounds = 3;         // Newton's steps for a reading that is bent or clipped

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
  prior.push_back(!loop.level_free ? kLimits.level * std::abs(model.process.gain) * loop.co_span
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
      observed_(observed),
      noise_rms_(noise_rms),
      blocks_(observed, samples,
              block_length(loop.model.process.time_constant_s * (loop.wide ? 0.5 : 1.0),
                           observed.period_s, samples),
              noise_rms),
      errors_(blocks_,
              {.returns_s = std::max(blocks_.duration_s(), 20.0 * loop.answer_s),
               .answer_s = loop.answer_s},
              loop.pv_span, loop.largest_disturbance,
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

// Signals at every sample and their prior deviations, in the order of the linear parameters.
void Likelihood::collect(const Hypothesis& hypothesis, const Point& point, Work& work) const {
  work.signals.clear();
  work.prior.clear();
  const auto add = [&](const std::vector<double>& signal, double deviation) {
    work.signals.push_back(&signal);
    work.prior.push_back(deviation);
  };
  const std::size_t moving = Columns::kFirstFixed;
  for (std::size_t i = 0; i < moving; ++i) add(work.columns[i], prior_of(hypothesis, i));
  for (std::size_t i = 0; i < fixed(); ++i) add(run_.fixed()[i], prior_[moving + i]);
  const Terms& terms = hypothesis.terms();
  work.solved.resize(std::max(work.solved.size(), terms.size()));
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (terms[i]->columns == 0) continue;
    run_.solved(hypothesis, point, i, blocks_.samples(), work.solved[i]);
    for (const auto& column : work.solved[i]) {
      // By its rms at every sample: blocks average high frequencies away.
      add(column, kLimits.solved * loop_.pv_span / std::max(numeric::rms(column), 1e-9));
    }
  }
  for (std::size_t i = 0; work.extra != nullptr && i < work.extra->signals.size(); ++i) {
    add(work.extra->signals[i], work.extra->deviations[i]);
  }
}

// Signals and PV over blocks, after the filter. The fixed signals and PV are ready for each pair
// of the error grid; `filter` null: of pair `index`.
void Likelihood::whiten(std::size_t index, const ErrorFilter* filter, Work& work) const {
  const std::size_t size = work.signals.size();
  const std::size_t first = Columns::kFirstFixed;
  work.means.resize(std::max(work.means.size(), size));
  work.white.resize(static_cast<Eigen::Index>(blocks_.count()),
                    static_cast<Eigen::Index>(size) + 1);
  std::vector<std::pair<const double*, std::size_t>> in;  // mean, column
  for (std::size_t i = 0; i <= size; ++i) {
    const bool is_fixed = i >= first && i < first + fixed();
    if (is_fixed || i == size) {
      const auto ready = static_cast<Eigen::Index>(i == size ? fixed() : i - first);
      if (filter == nullptr) {
        work.white.col(static_cast<Eigen::Index>(i)) = white_[index].columns.col(ready);
      } else {
        in.emplace_back((i == size ? pv_ : fixed_[i - first]).data(), i);
      }
      continue;
    }
    work.means[i].resize(blocks_.count());
    blocks_.average(*work.signals[i], work.means[i]);
    in.emplace_back(work.means[i].data(), i);
  }
  whiten(filter != nullptr ? *filter : errors_.at(index), in, work);
  work.white.col(static_cast<Eigen::Index>(size)) -= work.white.col(0);  // K' counts from 1
}

void Likelihood::whiten(const ErrorFilter& filter,
                        std::span<const std::pair<const double*, std::size_t>> in, Work& work) {
  for (std::size_t i = 0; i < in.size(); i += 4) {
    const double* from[4];
    double* to[4];
    for (std::size_t j = 0; j < 4; ++j) {
      const auto [mean, column] = in[std::min(i + j, in.size() - 1)];
      from[j] = mean;
      to[j] = work.white.col(static_cast<Eigen::Index>(column)).data();
    }
    filter.whiten_four(from, to);
  }
}

// The same for a reading that is bent or clipped. Newton's step at the linear parameters `mean`:
// every signal times the slope of the reading, and PV less what the reading shows.
void Likelihood::whiten_bent(const Hypothesis& hypothesis, const Point& point,
                             const Eigen::VectorXd& mean, const ErrorFilter& filter,
                             Work& work) const {
  constexpr double kStep = 1e-6;  // of the PV span
  const std::size_t samples = blocks_.samples();
  const std::size_t size = work.signals.size();
  const double step = kStep * loop_.pv_span;
  std::vector<double> flat(samples);  // PV before the reading, offset taken off
  for (std::size_t i = 0; i < size; ++i) {
    const double by = mean(static_cast<Eigen::Index>(i)) + (i == 0 ? 1.0 : 0.0);
    for (std::size_t k = 0; k < samples; ++k) flat[k] += by * (*work.signals[i])[k];
  }
  std::vector<double> shown(samples);
  for (std::size_t k = 0; k < samples; ++k) shown[k] = run_.offset()[k] + flat[k];
  std::vector<double> slope = shown;
  for (double& v : slope) v += step;
  run_.read(hypothesis, point, shown);
  run_.read(hypothesis, point, slope);
  std::vector<double> bent(samples);
  work.means.resize(std::max(work.means.size(), size + 1));
  work.white.resize(static_cast<Eigen::Index>(blocks_.count()),
                    static_cast<Eigen::Index>(size) + 1);
  std::vector<std::pair<const double*, std::size_t>> in;
  for (std::size_t i = 0; i <= size; ++i) {
    for (std::size_t k = 0; k < samples; ++k) {
      if (i == 0) slope[k] = (slope[k] - shown[k]) / step;
      bent[k] = i < size ? slope[k] * (*work.signals[i])[k]
                         : observed_.pv[k] - shown[k] + slope[k] * flat[k];
    }
    work.means[i].resize(blocks_.count());
    blocks_.average(bent, work.means[i]);
    in.emplace_back(work.means[i].data(), i);
  }
  whiten(filter, in, work);
  work.white.col(static_cast<Eigen::Index>(size)) -= work.white.col(0);
}

// The linear parameters from the columns after the filter. Returns the log-likelihood.
double Likelihood::solve(const ErrorFilter& filter, Work& work, Solution* solution) const {
  const auto size = static_cast<Eigen::Index>(work.signals.size());
  Eigen::MatrixXd gram(size + 1, size + 1);
  gram.setZero();
  gram.selfadjointView<Eigen::Lower>().rankUpdate(work.white.transpose());
  const Eigen::Map<const Eigen::VectorXd> prior(work.prior.data(), size);
  Eigen::MatrixXd q = gram.topLeftCorner(size, size).selfadjointView<Eigen::Lower>();
  q = prior.asDiagonal() * q * prior.asDiagonal();
  q.diagonal().array() += 1.0;
  const Eigen::VectorXd v = prior.cwiseProduct(gram.row(size).head(size).transpose());
  const Eigen::LLT<Eigen::MatrixXd> factor(q);
  const Eigen::VectorXd weights = factor.solve(v);
  double log_det = 0.0;
  for (Eigen::Index i = 0; i < size; ++i) log_det += 2.0 * std::log(factor.matrixLLT()(i, i));
  const double log_likelihood =
      -0.5 * (gram(size, size) - v.dot(weights) + log_det + filter.log_determinant());
  if (solution == nullptr) return log_likelihood;
  solution->mean = prior.cwiseProduct(weights);
  solution->covariance =
      prior.asDiagonal() * factor.solve(Eigen::MatrixXd::Identity(size, size)) * prior.asDiagonal();
  solution->design = work.white.leftCols(size);
  solution->innovations = work.white.col(size) - solution->design * solution->mean;
  solution->log_scales = filter.log_scales();
  return log_likelihood;
}

double Likelihood::of(const Hypothesis& hypothesis, std::span<const double> z, Work& work,
                      Solution* solution) const {
  const Point point = hypothesis.at(z);
  const bool guided = hypothesis.sticking() != Hypothesis::npos && point.jitter > 0.0;
  const bool jitters = hypothesis.jumps() && point.jitter > 0.0;
  // Other sizes of the error need no other free run.
  const std::span<const double> place = z.first(hypothesis.layout().jitter);
  const bool same = !work.stem.empty() && work.terms == hypothesis.terms() &&
                    work.guided == guided &&
                    std::equal(place.begin(), place.end(), work.place.begin(), work.place.end());
  if (!same) {
    ++work.evaluations;
    work.place.clear();
    work.stem.clear();
    try {
      work.penalty = run_.run(hypothesis, point, blocks_.samples(), guided ? &slips_ : nullptr,
                              work.columns, &work.stem);
    } catch (const effects::EffectError&) {
      return kImpossible;  // outside what the law accepts
    }
    work.terms = hypothesis.terms();
    work.guided = guided;
    work.place.assign(place.begin(), place.end());
  }
  collect(hypothesis, point, work);
  const std::size_t index = errors_.index(point.disturbance, point.law);
  std::optional<ErrorFilter> own;
  if (jitters) {
    std::vector<double> variance(blocks_.count());
    add_jumps(point, work.stem, variance);
    own = errors_.with_jumps(index, variance);
  }
  const ErrorFilter& filter = own ? *own : errors_.at(index);
  double log_likelihood = 0.0;
  if (!hypothesis.bends_reading()) {
    whiten(index, own ? &*own : nullptr, work);
    log_likelihood = solve(filter, work, solution);
  } else {
    Solution at;
    at.mean = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(work.signals.size()));
    for (int round = 0; round < kBentRounds; ++round) {
      whiten_bent(hypothesis, point, at.mean, filter, work);
      log_likelihood = solve(filter, work, &at);
    }
    if (solution != nullptr) *solution = std::move(at);
  }
  log_likelihood = std::isfinite(log_likelihood) ? log_likelihood - work.penalty : kImpossible;
  if (solution != nullptr) solution->log_likelihood = log_likelihood;
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
  if (hypothesis.bends_reading()) run_.read(hypothesis, point, pv);
  return pv;
}

}  // namespace loopwarden::estimator
