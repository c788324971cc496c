// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

#include "lab/plan_study/plan_study.hpp"
#include "model/estimator/judge_test.hpp"
#include "model/estimator/plan.hpp"
#include "model/numeric/statistics.hpp"
#include "model/plant/plant.hpp"

namespace loopwarden::lab::plan_study {
namespace {

using estimator::Estimate;
using estimator::Explanation;
using estimator::Observed;

constexpr std::array<double, 5> kSplits{0.3, 0.4, 0.5, 0.6, 0.7};  // of the record
constexpr double kReversal = 0.3;                                  // of the range of CO
constexpr double kMost = 60.0;                                     // answer times of a move
constexpr std::size_t kSimulated = 6;                              // of each explanation

// Sample at which the second reversal of CO after `begin` is seen.
std::size_t end_of_move(const Observed& o, std::size_t begin, double answer_s) {
  std::vector<double> co = o.co;
  const double least = kReversal * (numeric::quantile(co, 0.95) - numeric::quantile(co, 0.05));
  double low = o.co[begin];
  double high = low;
  int way = 0;
  int reversals = 0;
  const auto most = begin + static_cast<std::size_t>(kMost * answer_s / o.period_s);
  for (std::size_t k = begin; k < std::min(o.co.size(), most); ++k) {
    low = std::min(low, o.co[k]);
    high = std::max(high, o.co[k]);
    const int now = o.co[k] > low + least ? 1 : o.co[k] < high - least ? -1 : 0;
    if (now == 0 || now == way) continue;
    if (way != 0 && ++reversals == 2) return k;
    way = now;
    low = high = o.co[k];
  }
  return std::min(o.co.size(), most);
}

Observed first_part(const Observed& o, std::size_t count) {
  const auto n = static_cast<std::ptrdiff_t>(count);
  return {o.period_s,
          {o.co.begin(), o.co.begin() + n},
          {o.pv.begin(), o.pv.begin() + n},
          {o.used.begin(), o.used.begin() + n}};
}

std::vector<double> free_run(const plant::LoopModel& model, const std::vector<double>& co,
                             std::size_t end, std::uint64_t seed) {
  plant::Plant plant(model, seed);
  plant.reset(co.front());
  std::vector<double> pv{plant.process_variable()};
  for (std::size_t k = 1; k < end; ++k) pv.push_back(plant.step(co[k - 1]));
  return pv;
}

std::optional<double> log_likelihood_of(const Estimate& e, const std::vector<std::string>& names) {
  for (const estimator::Ranked& r : e.ranked) {
    if (r.title == title(names)) return r.log_likelihood;
  }
  return std::nullopt;
}

// Log Bayes factors of the first explanation over the second that a move brings.
class NaturalMove {
 public:
  NaturalMove(const Loop& loop, const Estimate& e, std::size_t begin, std::size_t end)
      : loop_(loop), start_(start_of(loop, e)), estimate_(e), begin_(begin), end_(end) {
    before_ = lead(loop.observed.pv, begin, begin + 2, 0.0);
  }

  // Mean over simulated moves of explanation `truth`.
  double predicted(std::size_t truth) const {
    const auto& samples = estimate_.explanations[truth].samples;
    double sum = 0.0;
    for (std::size_t i = 0; i < kSimulated; ++i) {
      plant::LoopModel model = samples[i % samples.size()];
      model.transmitter.noise = start_.noise_rms;
      if (start_.disturbance > 0.0) {
        model.disturbances.push_back(
            {"random_load", {{"intensity", start_.disturbance}, {"time_constant", 300.0}}});
      }
      // The simulated stem is not where the measured one is, so its whole record follows the
      // measured part.
      const std::vector<double> pv = free_run(model, loop_.observed.co, end_, 1000 * truth + i + 1);
      const double rest_s = estimator::kRest * plant::answer_s(loop_.model);
      const estimator::Drawn from{truth, i % samples.size()};
      sum += lead(pv, 0, end_, rest_s, from) - lead(pv, 0, begin_, rest_s, from);
    }
    return sum / static_cast<double>(kSimulated);
  }
  // Of the measured move.
  double measured() const { return lead(loop_.observed.pv, begin_, end_, 0.0) - before_; }

 private:
  double lead(const std::vector<double>& pv, std::size_t begin, std::size_t end, double rest_s,
              std::optional<estimator::Drawn> drawn = {}) const {
    const auto from = static_cast<std::ptrdiff_t>(begin);
    const auto to = static_cast<std::ptrdiff_t>(end);
    const Observed& o = loop_.observed;
    const Observed move{o.period_s,
                        {o.co.begin() + from, o.co.begin() + to},
                        {pv.begin() + from, pv.begin() + to},
                        {o.used.begin() + from, o.used.begin() + to}};
    const std::vector<double> score = estimate_.reweighted(move, rest_s, drawn).score;
    return score[0] - score[1];
  }

  const Loop& loop_;
  estimator::TestStart start_;
  const Estimate& estimate_;
  std::size_t begin_, end_;
  double before_ = 0.0;
};

void print_fit(const char* what, const std::vector<double>& x, const std::vector<double>& y) {
  const double mx = numeric::mean(x);
  const double my = numeric::mean(y);
  double xx = 0.0, xy = 0.0, yy = 0.0;
  std::size_t same_sign = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mx) * (x[i] - mx);
    xy += (x[i] - mx) * (y[i] - my);
    yy += (y[i] - my) * (y[i] - my);
    if (x[i] * y[i] > 0.0) ++same_sign;
  }
  fmt::print("{}: {} moves, correlation {:.2f}, slope {:.2f}, same sign {}\n", what, x.size(),
             xy / std::sqrt(xx * yy), xy / xx, same_sign);
}

}  // namespace

int study_measured(const std::vector<std::string>& folders) {
  std::vector<double> predicted, by_members, predicted_too, by_estimator;
  for (const std::string& folder : folders) {
    const Loop loop = read_loop(folder);
    const double answer_s = std::max(plant::answer_s(loop.model), loop.observed.period_s);
    std::size_t last = 0;
    for (const double split : kSplits) {
      const auto begin =
          static_cast<std::size_t>(split * static_cast<double>(loop.observed.pv.size()));
      const std::size_t end = end_of_move(loop.observed, begin, answer_s);
      if (begin < last || end < begin + 10) continue;  // moves do not overlap
      const Estimate before = estimator::estimate(first_part(loop.observed, begin), loop.model,
                                                  {.most_effects = 1, .fitted = begin}, one_thread);
      if (before.explanations.size() < 2) continue;
      last = end;
      const NaturalMove move(loop, before, begin, end);
      const Estimate after = estimator::estimate(first_part(loop.observed, end), loop.model,
                                                 {.most_effects = 1, .fitted = end}, one_thread);
      const Explanation& a = before.explanations[0];
      const Explanation& b = before.explanations[1];
      predicted.push_back(move.predicted(0));
      by_members.push_back(move.measured());
      const auto a0 = log_likelihood_of(before, a.effects);
      const auto b0 = log_likelihood_of(before, b.effects);
      const auto a1 = log_likelihood_of(after, a.effects);
      const auto b1 = log_likelihood_of(after, b.effects);
      double brought = std::nan("");
      if (a0 && b0 && a1 && b1) {
        brought = (*a1 - *b1) - (*a0 - *b0);
        predicted_too.push_back(predicted.back());
        by_estimator.push_back(brought);
      }
      fmt::print(
          "{:<20} {:5} to {:5}  {} {:.2f} / {} {:.2f}  predicted {:.1f} or {:.1f}, brought {:.1f}, "
          "estimator {:.1f}\n",
          std::filesystem::path(folder).filename().string(), begin, end, title(a.effects),
          a.probability, title(b.effects), b.probability, predicted.back(), move.predicted(1),
          by_members.back(), brought);
      std::fflush(stdout);
    }
  }
  if (predicted.size() > 2) print_fit("by the members", predicted, by_members);
  if (by_estimator.size() > 2) print_fit("by the estimator", predicted_too, by_estimator);
  return 0;
}

}  // namespace loopwarden::lab::plan_study
