// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/excitation.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "model/analysis/limits.hpp"
#include "model/numeric/enum_name.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::analysis {
namespace {

constexpr double kRounding = 1e-12;  // share of the squared moves of CO

bool moves(std::span<const double> column) {
  return std::any_of(column.begin(), column.end(), [&](double v) { return v != column.front(); });
}

bool in_automatic(const numeric::LoopView& c, std::size_t k) {
  return c.automatic.empty() || c.automatic[k] > 0.5;
}

using Terms = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 10, 1>;

struct Regression {
  Eigen::VectorXd solved;
  Eigen::VectorXd left;
};

// Returns the terms of the law for the move of CO at k: those of m, a, c (if SP moves) and b.
Terms terms(const numeric::LoopView& c, std::size_t k, bool set_point_moves) {
  const Eigen::Index of_sp = set_point_moves ? 3 : 0;
  Terms t(7 + of_sp);
  t(0) = 1.0;
  for (std::size_t i = 0; i < Limits::kLawLags; ++i) {
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

// The rows in which CO moves, by direction.
struct Moves {
  std::vector<std::size_t> up, down;
  bool two_levels = true;
};

Moves moves_of(const numeric::LoopView& c) {
  const auto [low, high] = std::minmax_element(c.co.begin(), c.co.end());
  Moves moves;
  for (std::size_t k = 1; k < c.co.size(); ++k) {
    moves.two_levels = moves.two_levels && (c.co[k] == *low || c.co[k] == *high);
    if (c.co[k] == c.co[k - 1] || !in_automatic(c, k)) continue;
    (c.co[k] > c.co[k - 1] ? moves.up : moves.down).push_back(k);
  }
  return moves;
}

double spread(const std::vector<double>& v) {
  return numeric::quantile(v, 0.9) - numeric::quantile(v, 0.1);
}

std::vector<double> steps_between(const std::vector<std::size_t>& rows) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    steps.push_back(static_cast<double>(rows[i] - rows[i - 1]));
  }
  return steps;
}

// Returns whether the moves at `rows` are at first passages: at the first row after the last
// opposite move at which `x` has passed their usual level. `side`: 1 if `x` rises to the level, -1
// if it falls.
bool at_first_passage(std::span<const double> x, const std::vector<std::size_t>& rows,
                      const std::vector<std::size_t>& others, double side) {
  std::vector<double> at;
  for (const std::size_t k : rows) at.push_back(side * x[k]);
  // Nearly all moves are beyond this level.
  const double level = numeric::quantile(at, 0.1);
  std::size_t on_time = 0;
  std::size_t count = 0;
  for (const std::size_t k : rows) {
    const auto next = std::lower_bound(others.begin(), others.end(), k);
    if (next == others.begin()) continue;
    std::size_t first = *(next - 1);
    while (first < k && side * x[first] < level) ++first;
    ++count;
    if (k - first <= Limits::kRowsOff) ++on_time;
  }
  return count > 0 && static_cast<double>(on_time) >= Limits::kOnTime * static_cast<double>(count);
}

bool switches_at_levels(std::span<const double> x, const Moves& moves) {
  // A clock switches after equal times, independent of PV.
  const auto clocked = [](const std::vector<std::size_t>& a, const std::vector<std::size_t>& b) {
    std::vector<double> lengths;
    for (const std::size_t k : a) {
      const auto next = std::upper_bound(b.begin(), b.end(), k);
      if (next != b.end()) lengths.push_back(static_cast<double>(*next - k));
    }
    return spread(lengths) <= static_cast<double>(Limits::kRowsOff);
  };
  if (clocked(moves.up, moves.down) && clocked(moves.down, moves.up)) return false;
  // The controller switches up at a low PV, or at a high PV.
  for (const double side : {1.0, -1.0}) {
    if (at_first_passage(x, moves.down, moves.up, side) &&
        at_first_passage(x, moves.up, moves.down, -side)) {
      return true;
    }
  }
  return false;
}

bool pulses_follow(const numeric::LoopView& c, std::span<const double> x, const Moves& moves) {
  const std::vector<double> cycles = steps_between(moves.up);
  const double cycle = numeric::median(cycles);
  const auto regular = std::count_if(cycles.begin(), cycles.end(), [&](double v) {
    const double whole = std::max(1.0, std::round(v / cycle));
    return std::abs(v - whole * cycle) <= whole;
  });
  if (cycle < 3.0 ||
      static_cast<double>(regular) < Limits::kOnTime * static_cast<double>(cycles.size())) {
    return false;
  }
  std::vector<double> on, pv;
  for (std::size_t i = 1; i < moves.up.size(); ++i) {
    const auto from = static_cast<std::ptrdiff_t>(moves.up[i - 1]);
    const auto to = static_cast<std::ptrdiff_t>(moves.up[i]);
    on.push_back(numeric::mean({c.co.begin() + from, c.co.begin() + to}));
    pv.push_back(x[moves.up[i - 1]]);
  }
  return find_feedback({.pv = pv, .co = on}).closed;
}

// Returns the share of rows in which CO moves, among the rows with `x` beyond its median in `moves`
// on that side.
double moving_share(std::span<const double> x, const std::vector<std::size_t>& moves, double side) {
  std::vector<double> at;
  for (const std::size_t k : moves) at.push_back(side * x[k]);
  const double level = numeric::median(at);
  const auto rows = std::count_if(x.begin(), x.end(), [&](double v) { return side * v >= level; });
  return 0.5 * static_cast<double>(moves.size()) /
         static_cast<double>(std::max<std::ptrdiff_t>(rows, 1));
}

// Returns whether nearly all up moves are at a lower PV than nearly all down moves, or the reverse.
// CO must move as long as PV is on that side.
bool moves_by_side(std::span<const double> x, const Moves& moves) {
  std::vector<double> down;
  for (const std::size_t k : moves.down) down.push_back(x[k]);
  std::sort(down.begin(), down.end());
  const double lower = numeric::mean(down);
  double upper = 0.0;
  for (const std::size_t k : moves.up) upper += x[k] / static_cast<double>(moves.up.size());
  const double side = upper >= lower ? 1.0 : -1.0;
  if (moving_share(x, moves.up, side) < Limits::kLeastMoving ||
      moving_share(x, moves.down, -side) < Limits::kLeastMoving) {
    return false;
  }
  double above = 0.0;
  for (const std::size_t k : moves.up) {
    above += static_cast<double>(down.end() - std::upper_bound(down.begin(), down.end(), x[k]));
  }
  const double share =
      above / (static_cast<double>(moves.up.size()) * static_cast<double>(down.size()));
  return share > Limits::kApart || share < 1.0 - Limits::kApart;
}

// Returns whether CO moves after moves of SP.
bool answers_set_point(const numeric::LoopView& c) {
  const auto moves_within = [&](std::size_t k) {
    const std::size_t end = std::min(k + Limits::kRowsOff + 1, c.co.size());
    for (std::size_t i = k; i < end; ++i) {
      if (c.co[i] != c.co[i - 1]) return true;
    }
    return false;
  };
  double moved = 0.0, answered = 0.0, by_chance = 0.0;
  for (std::size_t k = 1; k < c.sp.size(); ++k) {
    const bool follows = moves_within(k);
    by_chance += follows ? 1.0 : 0.0;
    if (c.sp[k] == c.sp[k - 1]) continue;
    moved += 1.0;
    answered += follows ? 1.0 : 0.0;
  }
  return moved >= static_cast<double>(Limits::kFewestSetPoints) &&
         answered >= Limits::kAnswered * moved &&
         by_chance < Limits::kByChance * static_cast<double>(c.sp.size());
}

// Returns whether PV moves in the same direction before and after the moves of a mostly constant
// CO. In that case PV responds to CO, which is logged too late, and CO doesn't act against PV.
bool goes_on_the_same_way(const numeric::LoopView& c) {
  double moves = 0.0;
  double du2 = 0.0, before2 = 0.0, after2 = 0.0, with_before = 0.0, with_after = 0.0;
  for (std::size_t k = Limits::kLawLags; k + Limits::kRowsOff < c.co.size(); ++k) {
    const double du = c.co[k] - c.co[k - 1];
    if (du == 0.0) continue;
    moves += 1.0;
    const double sp_moved = c.sp.empty() ? 0.0 : c.sp[k] - c.sp[k - Limits::kLawLags];
    const double before = c.pv[k] - c.pv[k - Limits::kLawLags] - sp_moved;
    const double after = c.pv[k + Limits::kRowsOff] - c.pv[k];
    du2 += du * du;
    before2 += before * before;
    after2 += after * after;
    with_before += du * before;
    with_after += du * after;
  }
  return moves < Limits::kMostMoving * static_cast<double>(c.co.size()) &&
         std::abs(with_before) > Limits::kSameWay * std::sqrt(du2 * before2) &&
         std::abs(with_after) > Limits::kSomeWay * std::sqrt(du2 * after2) &&
         with_before * with_after > 0.0;
}

}  // namespace

const char* to_text(SwitchingLaw law) noexcept {
  return numeric::enum_name<SwitchingLaw::gap_action>(
      law, {"none", "two levels", "pulses", "gap action"});
}

SwitchingLaw switching_law(const numeric::LoopView& c) {
  const Moves moves = moves_of(c);
  if (moves.up.size() < Limits::kFewestSwitches || moves.down.size() < Limits::kFewestSwitches) {
    return SwitchingLaw::none;
  }
  const double moving = static_cast<double>(moves.up.size() + moves.down.size());
  if (moving > Limits::kMostMoving * static_cast<double>(c.co.size())) return SwitchingLaw::none;
  std::vector<double> x(c.pv.begin(), c.pv.end());
  for (std::size_t k = 0; k < c.sp.size(); ++k) x[k] -= c.sp[k];
  if (!moves.two_levels) {
    return moves_by_side(x, moves) ? SwitchingLaw::gap_action : SwitchingLaw::none;
  }
  if (switches_at_levels(x, moves)) return SwitchingLaw::two_levels;
  return pulses_follow(c, x, moves) ? SwitchingLaw::pulses : SwitchingLaw::none;
}

Feedback find_feedback(const numeric::LoopView& c) {
  Feedback f;
  f.set_point_moves = !c.sp.empty() && moves(c.sp);
  std::vector<std::size_t> rows;
  std::size_t automatic = 0;
  for (std::size_t k = Limits::kLawLags; k < c.co.size(); ++k) {
    if (!c.automatic.empty() && c.automatic[k] > 0.5) ++automatic;
    bool all = true;
    for (std::size_t i = 0; i <= Limits::kLawLags; ++i) all = all && in_automatic(c, k - i);
    if (all) rows.push_back(k);
  }
  f.by_mode = automatic > 0;
  f.closed = f.by_mode;
  if (rows.size() < Limits::kFewestLawRows) return f;
  const std::size_t every = (rows.size() + Limits::kMostRows - 1) / Limits::kMostRows;
  const auto n = static_cast<Eigen::Index>((rows.size() + every - 1) / every);
  const Eigen::Index of_sp = f.set_point_moves ? 3 : 0;
  Eigen::MatrixXd columns(n, 7 + of_sp);
  Eigen::VectorXd u(n);
  for (Eigen::Index r = 0; r < n; ++r) {
    const std::size_t k = rows[static_cast<std::size_t>(r) * every];
    // Differences from the previous value keep large levels from hiding the law.
    u(r) = c.co[k] - c.co[k - 1];
    columns.row(r) = terms(c, k, f.set_point_moves).transpose();
  }
  // Rows with jumps are left out of the law: a set point that is not in the record, or a manual
  // move.
  Regression with = regress(columns, u);
  std::vector<double> sizes;
  for (const double left : with.left) sizes.push_back(std::abs(left));
  const double limit = Limits::kJump * numeric::kNormalOverMad * numeric::median(std::move(sizes));
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
  if (free > 0 && before > kRounding * u.squaredNorm()) {
    // With few rows, three terms always explain a share of the sums, so the variances are compared.
    const double left =
        law.left.squaredNorm() / before * static_cast<double>(free + 3) / static_cast<double>(free);
    f.explained = std::clamp(1.0 - left, 0.0, 1.0);
  }
  const Eigen::VectorXd& solved = c.sp.empty() ? law.solved : with.solved;
  f.closed = f.by_mode || (c.automatic.empty() &&
                           (f.explained > Limits::kFeedbackShare || answers_set_point(c)) &&
                           !goes_on_the_same_way(c));
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

std::vector<double> outside_output(const numeric::LoopView& c, const Feedback& f,
                                   const plant::ProcessParameters& parameters, double period_s) {
  const std::size_t n = c.co.size();
  const auto [low, high] = std::minmax_element(c.co.begin(), c.co.end());
  const double far = Limits::kRunsAway * (*high - *low);
  plant::Process process(parameters, period_s);
  process.reset(0.0);
  std::vector<double> u(n, 0.0);
  std::vector<double> y(n, 0.0);
  for (std::size_t k = 0; k < n; ++k) {
    if (!in_automatic(c, k)) {
      u[k] = c.co[k] - c.co.front();
    } else if (k >= Limits::kLawLags) {
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

PiGains find_pi_gains(const numeric::LoopView& c) {
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
    columns(r, 1) = e * c.period_s;
    if (!sp_known) columns(r, 2) = c.period_s;
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
