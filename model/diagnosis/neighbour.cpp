// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/neighbour.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "model/diagnosis/limits.hpp"
#include "model/numeric/loop_record.hpp"
#include "model/numeric/statistics.hpp"
#include "model/diagnosis/group.hpp"

namespace loopwarden::diagnosis {
namespace {

using diagnosis::Cause;
using diagnosis::DiagnosisVerdict;

constexpr std::size_t kFolds = 4;

constexpr std::size_t kOwn = 2 * Limits::kHistoryLags;
constexpr std::size_t kOther = 2 * Limits::kOtherLags;
constexpr std::size_t kRegressors = kOwn + kOther;

using Gram = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic>;

std::vector<double> scaled(std::span<const double> x) {
  const std::vector<double> known = numeric::known(x);
  const double mean = numeric::mean(known);
  const double deviation = numeric::deviation(known);
  std::vector<double> z(x.begin(), x.end());
  for (double& v : z) v = deviation > 0.0 ? (v - mean) / deviation : v - mean;
  return z;
}

// Returns the coefficients of the first `count` regressors. The predicted value follows after all
// regressors.
Eigen::VectorXd coefficients(const Gram& gram, Eigen::Index count) {
  const Eigen::Index value = gram.cols() - 1;
  Gram normal = gram.topLeftCorner(count, count);
  normal.diagonal().array() += 1e-9 * gram.diagonal().maxCoeff() + 1e-300;
  return normal.selfadjointView<Eigen::Lower>().ldlt().solve(gram.col(value).head(count));
}

double sum_of_squares(const Gram& gram, const Eigen::VectorXd& b) {
  const Eigen::Index value = gram.cols() - 1;
  return gram(value, value) - 2.0 * b.dot(gram.col(value).head(b.size())) +
         b.dot(gram.topLeftCorner(b.size(), b.size()) * b);
}

// Fills a row: own past of PV and CO, the other's past `shift` samples away (if any), and the
// value. False if one is missing.
bool fill_row(const LoopMoves& own, const LoopMoves* other, std::size_t shift, std::size_t k,
              Eigen::Ref<Eigen::VectorXd> row) {
  Eigen::Index at = 0;
  for (std::size_t l = 1; l <= Limits::kHistoryLags; ++l) {
    row[at++] = own.pv[k - l];
    row[at++] = own.co[k - l];
  }
  const std::size_t n = own.pv.size();
  for (std::size_t l = Limits::kFirstLag;
       other != nullptr && l < Limits::kFirstLag + Limits::kOtherLags; ++l) {
    const std::size_t from = (k - l + shift) % n;
    row[at++] = other->pv[from];
    row[at++] = other->co[from];
  }
  row[at] = own.pv[k];
  return row.array().isFinite().all();
}

void take_out_own_past(LoopMoves& loop) {
  const std::size_t n = loop.pv.size();
  loop.unforeseen.assign(n, 0.0);
  Gram gram = Gram::Zero(kOwn + 1, kOwn + 1);
  Eigen::VectorXd row(kOwn + 1);
  std::size_t rows = 0;
  for (std::size_t k = Limits::kHistoryLags; k < n; ++k) {
    if (!fill_row(loop, nullptr, 0, k, row)) continue;
    gram.noalias() += row * row.transpose();
    ++rows;
  }
  if (rows < Limits::kLeastRows) return;
  const Eigen::VectorXd b = coefficients(gram, kOwn);
  for (std::size_t k = Limits::kHistoryLags; k < n; ++k) {
    if (fill_row(loop, nullptr, 0, k, row)) loop.unforeseen[k] = row[kOwn] - b.dot(row.head(kOwn));
  }
}

void find_jumps(LoopMoves& loop) {
  const std::size_t n = loop.pv.size();
  loop.sudden.assign(n, 0.0);
  std::vector<double> sizes;
  for (std::size_t k = 0; k + Limits::kSuddenSamples <= n; ++k) {
    for (std::size_t l = 0; l < Limits::kSuddenSamples; ++l)
      loop.sudden[k] += loop.unforeseen[k + l];
    if (loop.unforeseen[k] != 0.0) sizes.push_back(std::abs(loop.sudden[k]));
  }
  const double measure = numeric::kNormalOverMad * numeric::median(std::move(sizes));
  if (!(measure > 1e-9)) {
    loop.sudden.assign(n, 0.0);
    return;
  }
  for (double& v : loop.sudden) v /= measure;
  loop.sudden_share = 1.0 / measure;
  double sum = 0.0;
  for (std::size_t k = Limits::kJumpsApart; k + Limits::kJumpsApart < n; ++k) {
    const double size = std::abs(loop.sudden[k]);
    if (size < Limits::kJumpFrom) continue;
    bool largest = true;
    for (std::size_t l = 1; l <= Limits::kJumpsApart; ++l) {
      largest =
          largest && size > std::abs(loop.sudden[k - l]) && size >= std::abs(loop.sudden[k + l]);
    }
    if (!largest) continue;
    loop.jumps.push_back(k);
    sum += size * size;
  }
  loop.jump_size = loop.jumps.size() < Limits::kLeastJumps / 2
                       ? Limits::kJumpFrom
                       : std::sqrt(sum / static_cast<double>(loop.jumps.size()));
}

// Collects moves of the victim at those jumps that the source makes itself, in the direction of
// each.
void moves_at_jumps(const LoopMoves& source, const LoopMoves& victim, std::size_t shift,
                    std::vector<double>& moves) {
  moves.clear();
  const std::size_t n = victim.sudden.size();
  for (const std::size_t k : source.jumps) {
    const double jump = source.sudden[k];
    const double move = victim.sudden[(k + shift) % n];
    if (std::abs(move) * source.jump_size > std::abs(jump) * victim.jump_size) continue;
    moves.push_back(jump > 0.0 ? move : -move);
  }
}

double agreement(const std::vector<double>& moves) {
  if (moves.size() < Limits::kLeastJumps) return 0.0;
  double sum = 0.0;
  for (const double move : moves) sum += std::clamp(move / Limits::kFullMove, -1.0, 1.0);
  return std::abs(sum) / std::sqrt(static_cast<double>(moves.size()));
}

std::optional<Push> push_by_jumps(const LoopMoves& source, const LoopMoves& victim) {
  const std::size_t n = source.pv.size();
  if (source.jumps.size() < Limits::kLeastJumps || !(victim.sudden_share > 0.0))
    return std::nullopt;
  std::vector<double> moves;
  moves_at_jumps(source, victim, 0, moves);
  const double here = agreement(moves);
  if (here < Limits::kLeastAgreement) return std::nullopt;
  const double size = std::abs(numeric::median(moves)) / victim.sudden_share;
  if (size < Limits::kLeastVictimMove) return std::nullopt;
  for (std::size_t shift = n / 10; shift <= n - n / 10; ++shift) {
    moves_at_jumps(source, victim, shift, moves);
    if (agreement(moves) >= here) return std::nullopt;
  }
  return Push{.by_jumps = true, .size = size};
}

struct Gain {
  double all = 0.0;    // of the record
  double least = 0.0;  // of its parts
};

Gain gain(const LoopMoves& source, const LoopMoves& victim, std::size_t shift) {
  const std::size_t n = victim.pv.size();
  const std::size_t first = std::max(Limits::kHistoryLags, Limits::kFirstLag + Limits::kOtherLags);
  constexpr Eigen::Index kColumns = kRegressors + 1;
  Eigen::MatrixXd rows(kColumns, static_cast<Eigen::Index>(n / kFolds + 1));
  std::array<Gram, kFolds> grams;
  Gram whole = Gram::Zero(kColumns, kColumns);
  std::size_t used = 0;
  for (std::size_t part = 0; part < kFolds; ++part) {
    Eigen::Index count = 0;
    for (std::size_t k = std::max(first, n * part / kFolds); k < n * (part + 1) / kFolds; ++k) {
      if (fill_row(victim, &source, shift, k, rows.col(count))) ++count;
    }
    grams[part] = Gram::Zero(kColumns, kColumns);
    grams[part].selfadjointView<Eigen::Lower>().rankUpdate(rows.leftCols(count));
    grams[part] = Gram(grams[part].selfadjointView<Eigen::Lower>());
    whole += grams[part];
    used += static_cast<std::size_t>(count);
  }
  if (used < Limits::kLeastRows) return {};
  double with = 0.0;
  double without = 0.0;
  double least = 1.0;
  for (const Gram& part : grams) {
    const Gram others = whole - part;
    const double better = sum_of_squares(part, coefficients(others, kRegressors));
    const double plain = sum_of_squares(part, coefficients(others, kOwn));
    with += better;
    without += plain;
    least = std::min(least, 1.0 - better / plain);
  }
  if (!(without > 1e-9 * whole(kRegressors, kRegressors))) return {};
  return {1.0 - with / without, least};
}

// Returns the largest squared correlation of the unpredicted moves within a sample.
double at_once(const LoopMoves& a, const LoopMoves& b) {
  const std::size_t n = a.unforeseen.size();
  const double squares = std::pow(
      numeric::rms(a.unforeseen) * numeric::rms(b.unforeseen) * static_cast<double>(n), 2.0);
  if (!(squares > 0.0)) return 0.0;
  double most = 0.0;
  for (std::size_t lag = 0; lag <= 1; ++lag) {
    double ahead = 0.0;
    double behind = 0.0;
    for (std::size_t k = lag; k < n; ++k) {
      ahead += a.unforeseen[k - lag] * b.unforeseen[k];
      behind += a.unforeseen[k] * b.unforeseen[k - lag];
    }
    most = std::max({most, ahead * ahead / squares, behind * behind / squares});
  }
  return most;
}

std::optional<Push> push_by_order(const LoopMoves& source, const LoopMoves& victim) {
  const auto [here, least] = gain(source, victim, 0);
  if (here < Limits::kLeastPredicted || least < Limits::kLeastPredictedPart ||
      at_once(source, victim) >= here || Limits::kOtherWay * gain(victim, source, 0).all > here) {
    return std::nullopt;
  }
  const std::size_t n = source.pv.size();
  for (std::size_t s = 0; s < Limits::kShifts; ++s) {
    if (gain(source, victim, n / 10 + (n - n / 5) * s / (Limits::kShifts - 1)).all >= here) {
      return std::nullopt;
    }
  }
  return Push{.by_jumps = false, .size = here};
}

using Pair = std::pair<std::size_t, std::size_t>;

std::vector<Pair> best_correlated(std::span<const NeighbourLoop> loops, std::size_t most) {
  Eigen::MatrixXf moves(static_cast<Eigen::Index>(loops.front().summed.size()),
                        static_cast<Eigen::Index>(loops.size()));
  for (std::size_t k = 0; k < loops.size(); ++k) {
    moves.col(static_cast<Eigen::Index>(k)) =
        Eigen::Map<const Eigen::VectorXf>(loops[k].summed.data(), moves.rows());
  }
  const float least = static_cast<float>(Limits::kFirstCorrelation) /
                      std::sqrt(std::max(1.0F, static_cast<float>(moves.rows())));
  std::vector<std::tuple<float, std::size_t, std::size_t>> found;
  const auto keep_best = [&] {
    if (found.size() <= most) return;
    std::nth_element(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(most), found.end());
    found.resize(most);
  };
  constexpr Eigen::Index kBlock = 256;
  for (Eigen::Index a = 0; a < moves.cols(); a += kBlock) {
    const Eigen::Index wide = std::min(kBlock, moves.cols() - a);
    for (Eigen::Index b = a; b < moves.cols(); b += kBlock) {
      const Eigen::MatrixXf r = moves.middleCols(a, wide).transpose() *
                                moves.middleCols(b, std::min(kBlock, moves.cols() - b));
      for (Eigen::Index j = 0; j < r.cols(); ++j) {
        for (Eigen::Index i = 0; i < r.rows() && a + i < b + j; ++i) {
          if (std::abs(r(i, j)) < least) continue;
          found.emplace_back(-std::abs(r(i, j)), static_cast<std::size_t>(a + i),
                             static_cast<std::size_t>(b + j));
        }
      }
    }
    keep_best();
  }
  std::vector<Pair> pairs;
  for (const auto& [r, a, b] : found) pairs.emplace_back(a, b);
  return pairs;
}

std::vector<Pair> nearest_periods(std::span<const NeighbourLoop> loops, std::size_t most) {
  std::vector<std::size_t> swinging;
  for (std::size_t k = 0; k < loops.size(); ++k) {
    if (loops[k].period_s > 0.0) swinging.push_back(k);
  }
  std::sort(swinging.begin(), swinging.end(), [&](std::size_t a, std::size_t b) {
    return std::tie(loops[a].period_s, a) < std::tie(loops[b].period_s, b);
  });
  constexpr std::size_t kEach = 8;
  std::vector<std::tuple<double, std::size_t, std::size_t>> found;
  for (std::size_t i = 0; i < swinging.size(); ++i) {
    for (std::size_t j = i + 1; j < std::min(swinging.size(), i + 1 + kEach); ++j) {
      const double ratio = loops[swinging[j]].period_s / loops[swinging[i]].period_s;
      if (ratio > Limits::kSameGroupPeriod) break;
      const auto [a, b] = std::minmax(swinging[i], swinging[j]);
      found.emplace_back(ratio, a, b);
    }
  }
  std::sort(found.begin(), found.end());
  found.resize(std::min(found.size(), most));
  std::vector<Pair> pairs;
  for (const auto& [ratio, a, b] : found) pairs.emplace_back(a, b);
  return pairs;
}

}  // namespace

LoopMoves moves_of(std::span<const double> pv, std::span<const double> co) {
  LoopMoves loop;
  loop.pv = scaled(pv);
  loop.co = scaled(co);
  take_out_own_past(loop);
  find_jumps(loop);
  return loop;
}

std::vector<float> summed_moves(const LoopMoves& loop) {
  Eigen::VectorXf sums = Eigen::VectorXf::Zero(
      static_cast<Eigen::Index>(loop.unforeseen.size() / Limits::kSummedMoves));
  for (Eigen::Index k = 0; k < sums.size(); ++k) {
    for (std::size_t l = 0; l < Limits::kSummedMoves; ++l) {
      sums[k] += static_cast<float>(
          loop.unforeseen[Limits::kSummedMoves * static_cast<std::size_t>(k) + l]);
    }
  }
  const float length = sums.norm();
  if (length > 0.0F) sums /= length;
  return {sums.begin(), sums.end()};
}

std::optional<Push> push(const LoopMoves& source, bool valve_effect, const LoopMoves& victim) {
  if (source.pv.size() != victim.pv.size() || source.pv.size() < Limits::kLeastRows)
    return std::nullopt;
  const std::optional<Push> jumps =
      valve_effect ? push_by_jumps(source, victim) : std::optional<Push>();
  return jumps ? jumps : push_by_order(source, victim);
}

std::vector<Pair> pairs_to_look_at(std::span<const NeighbourLoop> loops, std::size_t most) {
  std::vector<Pair> pairs;
  if (loops.size() * (loops.size() - 1) / 2 <= most) {
    for (std::size_t b = 1; b < loops.size(); ++b) {
      for (std::size_t a = 0; a < b; ++a) pairs.emplace_back(a, b);
    }
    return pairs;
  }
  pairs = best_correlated(loops, most);
  const std::vector<Pair> like = nearest_periods(loops, most);
  pairs.insert(pairs.end(), like.begin(), like.end());
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

bool neighbour_is_cause(DiagnosisVerdict verdict, Cause cause, bool main) noexcept {
  if (verdict == DiagnosisVerdict::healthy) return main;
  if (verdict != DiagnosisVerdict::other_cause) return false;
  return cause == Cause::disturbance || (cause == Cause::tuning && main);
}

}  // namespace loopwarden::diagnosis
