// SPDX-License-Identifier: Apache-2.0
#include "model/gap/fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "model/gap/constants.hpp"
#include "model/gap/fit_work.hpp"
#include "model/numeric/evolution.hpp"
#include "model/numeric/least_squares.hpp"
#include "model/numeric/random.hpp"

namespace loopwarden::gap {
namespace {

constexpr std::size_t kNuisances = 5;  // time constant, dead time, three of the healthy valve
// Parts of what is allowed, that are tried. The filters stand in rows of kLoads, one row for each
// of kValves.
constexpr std::array kLoads{0.0, 0.04, 0.125, 0.25, 0.5, 0.75, 1.0};
constexpr std::array kValves{0.0, 0.35, 1.0};
constexpr int kShownRounds = 3;
constexpr double kLeastVariance = 1e-18;  // of PV's mean square; what rounding of numbers leaves

// Up to what sampling can show; where the process is as fast as that, from half of it on.
effects::SearchRange actuator_frequency(const plant::LoopModel& model) {
  const double high = 0.9 * std::numbers::pi / model.sample_time_s;
  const double slow_s = plant::answer_s(model);
  const double low = 1.0 / std::min(effects::kFastActuator_s, effects::kFastActuator * slow_s);
  return {"natural_frequency", std::min(low, 0.5 * high), high, true, 1};
}

// By so much the actuator's answer to a ramp is late, s.
double actuator_delay_s(const Point& point) {
  return point.actuator_frequency > 0.0 ? 2.0 * point.actuator_damping / point.actuator_frequency
                                        : 0.0;
}

// By so much an overdamped actuator must be stiffer to be as fast.
double slowing(double damping) { return std::max(1.0, 2.0 * damping); }

bool is_smooth(const Terms& terms) {
  return std::all_of(terms.begin(), terms.end(), [](const Candidate* t) { return t->smooth; });
}

// Of normal equations whose columns may have any units: each is taken by its own size. One that
// never shows gets no share.
Eigen::MatrixXd solve_normal(const Eigen::MatrixXd& normal, const Eigen::MatrixXd& right) {
  Eigen::VectorXd size = normal.diagonal().cwiseMax(0.0).cwiseSqrt();
  Eigen::MatrixXd unit = normal;
  Eigen::MatrixXd scaled = right;
  for (Eigen::Index i = 0; i < size.size(); ++i) {
    const double by = size(i) > 0.0 ? 1.0 / size(i) : 0.0;
    unit.row(i) *= by;
    unit.col(i) *= by;
    scaled.row(i) *= by;
    size(i) = by;
  }
  unit.diagonal().setConstant(1.0 + 1e-9);
  return size.asDiagonal() * unit.ldlt().solve(scaled);
}

// At the lower end of its range what makes an effect more than a simpler one is nothing.
bool at_simpler(const Candidate& term, const std::vector<double>& searched) {
  constexpr double kAtEnd = 1e-3;  // of the range
  const effects::Descriptor* info = effects::find_effect(term.name);
  if (info == nullptr || info->more_by == nullptr) return false;
  for (std::size_t j = 0; j < term.search.size(); ++j) {
    if (std::string_view(term.search[j].name) != info->more_by) continue;
    if (term.search[j].position(searched[j]) < kAtEnd || searched[j] < term.more_from) return true;
  }
  return false;
}

}  // namespace

bool jumps(const Terms& terms) {
  return std::any_of(terms.begin(), terms.end(), [](const Candidate* t) {
    return t->block == effects::Block::valve && !t->smooth;
  });
}

Fitter::Fitter(const FreeRun& free_run, const std::vector<double>& pv,
               const std::vector<bool>& used, AllowedWander allowed, bool allowances)
    : free_run_(free_run),
      actuator_{effects::SearchRange{"damping", 0.05, 2.0, true, 1},
                actuator_frequency(free_run.model())},
      healthy_friction_(kHealthyFriction * (free_run.model().controller.pid.output_high -
                                            free_run.model().controller.pid.output_low)),
      dead_time_uncertainty_s_(free_run.model().uncertainty.dead_time *
                                   free_run.model().process.dead_time_s +
                               0.5 * free_run.model().sample_time_s),
      allowances_(allowances),
      used_(used),
      pv_(pv.size(), 0.0) {
  for (std::size_t k = 0; k < pv.size(); ++k) {
    if (!used[k]) continue;
    pv_[k] = pv[k] - free_run.offset()[k];
    training_end_ = k + 1;
  }
  double square = 0.0;
  for (const double v : pv_) square += v * v;
  const auto samples = static_cast<double>(std::count(used.begin(), used.end(), true));
  if (square > 0.0) pv_square_ = square / samples;
  const plant::LoopModel& model = free_run.model();
  // As long as the loop takes to move the stem on.
  const double forgets_s = std::max(plant::answer_s(model), model.sample_time_s);
  for (const double valve : kValves) {
    if (valve > 0.0 && !(allowed.valve > 0.0)) break;
    for (const double load : kLoads) {
      filters_.emplace_back(used, model.sample_time_s, load * allowed.load,
                            LoadFilter::Valve{valve * allowed.valve, forgets_s});
      white_pv_.emplace_back(filters_.back().count());
      filters_.back().whiten(pv_, white_pv_.back());
    }
  }
}

bool Fitter::load_at_limit(const Fit& fit) const noexcept {
  return fit.load % kLoads.size() + 1 == kLoads.size();
}

// Newton's step for what the transmitter hides or bends.
void Fitter::linearise_shown(Work& work, const Terms& terms, const Point& point,
                             std::size_t load) const {
  const std::vector<double>& offset = free_run_.offset();
  work.whole.assign(offset.begin(), offset.begin() + static_cast<std::ptrdiff_t>(training_end_));
  for (std::size_t i = 0; i < work.columns.size(); ++i) {
    const double by = work.solved(static_cast<Eigen::Index>(i));
    for (std::size_t k = 0; k < training_end_; ++k) work.whole[k] += by * work.columns[i][k];
  }
  work.shown = work.whole;
  free_run_.show(terms, point, work.shown);
  work.seen = work.columns;
  const std::vector<double> slope = free_run_.slopes(terms, point, work.whole);
  for (std::size_t k = 0; k < training_end_; ++k) {
    work.shown[k] = used_[k] ? pv_[k] + offset[k] - work.shown[k] : 0.0;
    for (std::size_t i = 0; i < work.seen.size(); ++i) {
      work.seen[i][k] *= slope[k];
      work.shown[k] += work.solved(static_cast<Eigen::Index>(i)) * work.seen[i][k];
    }
  }
  filters_[load].whiten(work.shown, work.target);
  filters_[load].whiten(work.seen, work.white);
}

double Fitter::solve(Work& work, const Terms& terms, const Point& point, std::size_t load,
                     Fit* fit) const {
  const LoadFilter& filter = filters_[load];
  const std::size_t n = filter.count();
  const std::size_t m = work.columns.size();
  work.target = white_pv_[load];
  filter.whiten(work.columns, work.white);
  const auto size = static_cast<Eigen::Index>(m);
  const auto view = [n](const std::vector<double>& v) {
    return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(n));
  };
  work.normal.resize(size, size);
  work.right.resize(size);
  // The gain within its bounds: if the free solution is outside, it lies on the bound.
  const double uncertainty = free_run_.model().uncertainty.gain;
  const bool gain_free = solves_gain(terms);
  const double low = gain_free ? 0.02 : 1.0 - uncertainty;
  const double high = gain_free ? 50.0 : 1.0 + uncertainty;
  const auto make_normal = [&] {
    for (std::size_t i = 0; i < m; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      for (std::size_t j = 0; j <= i; ++j) {
        const auto column = static_cast<Eigen::Index>(j);
        work.normal(row, column) = work.normal(column, row) =
            view(work.white[i]).dot(view(work.white[j]));
      }
      work.right(row) = view(work.white[i]).dot(view(work.target));
    }
  };
  const auto solve_once = [&] {
    make_normal();
    work.solved = solve_normal(work.normal, work.right);
    if (work.solved(0) >= low && work.solved(0) <= high) return;
    const double gain = std::clamp(std::isfinite(work.solved(0)) ? work.solved(0) : 1.0, low, high);
    const Eigen::Index rest = size - 1;
    work.solved.tail(rest) =
        solve_normal(work.normal.bottomRightCorner(rest, rest),
                     work.right.tail(rest) - gain * work.normal.col(0).tail(rest));
    work.solved(0) = gain;
  };
  solve_once();
  if (!free_run_.shows_all(terms)) {
    for (int round = 0; round < kShownRounds; ++round) {
      linearise_shown(work, terms, point, load);
      solve_once();
    }
    linearise_shown(work, terms, point, load);
    make_normal();
  }
  const double sum = view(work.target).squaredNorm() - 2.0 * work.solved.dot(work.right) +
                     work.solved.dot(work.normal * work.solved);
  const double count = static_cast<double>(n);
  if (!std::isfinite(sum)) {
    if (fit != nullptr) {
      fit->solved.assign(m, 0.0);
      fit->deviance = kInfinity;
    }
    return kInfinity;
  }
  const double variance = std::max(sum / count, kLeastVariance * pv_square_);
  // Of PV's own square, so that units change nothing.
  const double deviance = count * std::log(variance / pv_square_) + filter.log_determinant();
  if (fit != nullptr) {
    fit->solved.assign(work.solved.data(), work.solved.data() + size);
    fit->noise_rms = std::sqrt(variance);
    fit->samples = n;
    fit->load = load;
    fit->deviance = deviance;
  }
  return deviance;
}

void Fitter::columns(Work& work, const Terms& terms, const Point& point) const {
  free_run_.columns(terms, point, work.columns, training_end_);
  if (!level_held_ || !free_run_.fits_level()) return;
  std::vector<double>& level = work.columns[free_run_.base_columns() - 1];
  std::fill(level.begin(), level.end(), 0.0);
}

double Fitter::evaluate(Work& work, const Terms& terms, const Point& point, std::size_t load,
                        Fit* fit) const {
  columns(work, terms, point);
  return solve(work, terms, point, load, fit);
}

void Fitter::choose_load(Work& work, Fit& fit) const {
  columns(work, fit.terms, fit.point);
  // All of them: a load and what a valve leaves can stand for one another up to a point.
  std::size_t best = fit.load;
  double best_deviance = kInfinity;
  for (std::size_t load = 0; load < filters_.size(); ++load) {
    const double deviance = solve(work, fit.terms, fit.point, load, nullptr);
    if (deviance < best_deviance) {
      best_deviance = deviance;
      best = load;
    }
  }
  solve(work, fit.terms, fit.point, best, &fit);
}

// A quarter of the width of a spectral line for a period, else as the range says.
std::vector<double> Fitter::first_steps(const Fit& fit) const {
  const double duration_s = static_cast<double>(free_run_.size()) * free_run_.model().sample_time_s;
  std::vector<double> steps;
  for (std::size_t i = 0; i < fit.terms.size(); ++i) {
    for (std::size_t j = 0; j < fit.terms[i]->search.size(); ++j) {
      const effects::SearchRange& range = fit.terms[i]->search[j];
      steps.push_back(range.is_period ? 0.25 * fit.point.searched[i][j] / duration_s /
                                            std::log(range.high / range.low)
                                      : range.first_step);
    }
  }
  return steps;
}

std::vector<double> Fitter::positions(const Fit& fit) const {
  const plant::LoopModel& model = free_run_.model();
  const auto within = [](double value, double nominal, double uncertainty) {
    if (nominal <= 0.0 || uncertainty <= 0.0) return 0.5;
    return std::clamp((value / nominal - 1.0 + uncertainty) / (2.0 * uncertainty), 0.0, 1.0);
  };
  std::vector<double> x{
      within(fit.point.time_constant_s, model.process.time_constant_s,
             model.uncertainty.time_constant),
      std::clamp((model.process.dead_time_s + dead_time_uncertainty_s_ - fit.point.dead_time_s) /
                     (2.0 * dead_time_uncertainty_s_ + actuator_delay_s(fit.point)),
                 0.0, 1.0),
      actuator_[0].position(fit.point.actuator_damping),
      actuator_[1].position(fit.point.actuator_frequency / slowing(fit.point.actuator_damping)),
      healthy_friction_ > 0.0 ? fit.point.friction / healthy_friction_ : 0.0};
  for (std::size_t i = 0; i < fit.terms.size(); ++i) {
    for (std::size_t j = 0; j < fit.terms[i]->search.size(); ++j) {
      x.push_back(fit.terms[i]->search[j].position(fit.point.searched[i][j]));
    }
  }
  return x;
}

Point Fitter::with_positions(const Terms& terms, const std::vector<double>& x) const {
  const plant::LoopModel& model = free_run_.model();
  Point point;
  point.time_constant_s =
      model.process.time_constant_s * (1.0 + model.uncertainty.time_constant * (2.0 * x[0] - 1.0));
  point.actuator_damping = actuator_[0].value(x[2]);
  point.actuator_frequency =
      std::min(actuator_[1].value(x[3]) * slowing(point.actuator_damping), actuator_[1].high);
  point.friction = healthy_friction_ * x[4];
  if (!allowances_) point.actuator_frequency = 0.0;
  // Whoever measured the dead time had the actuator's delay in it.
  point.dead_time_s =
      std::max(0.0, model.process.dead_time_s + dead_time_uncertainty_s_ -
                        (2.0 * dead_time_uncertainty_s_ + actuator_delay_s(point)) * x[1]);
  std::size_t next = kNuisances;
  for (const Candidate* term : terms) {
    std::vector<double> values;
    for (const effects::SearchRange& range : term->search) values.push_back(range.value(x[next++]));
    point.searched.push_back(std::move(values));
  }
  return point;
}

// Derivative-free search over the terms' own parameters and those of the healthy valve, the process
// held.
Fit Fitter::search(Work& work, const Fit& start, int evaluations) const {
  const std::vector<double> x = positions(start);
  const std::vector<double> held(x.begin(), x.begin() + 2);
  std::vector<double> own(x.begin() + 2, x.end());
  std::vector<double> steps{0.1, 0.1, 0.2};
  for (const double first : first_steps(start)) steps.push_back(first);
  const auto at_point = [&](const std::vector<double>& at) {
    std::vector<double> all = held;
    all.insert(all.end(), at.begin(), at.end());
    return with_positions(start.terms, all);
  };
  std::vector<double> best = own;
  minimise(best, steps, evaluations, 1e-3, [&](const std::vector<double>& at) {
    return evaluate(work, start.terms, at_point(at), start.load, nullptr);
  });
  Fit fit = start;
  Fit tried = start;
  tried.point = at_point(best);
  evaluate(work, tried.terms, tried.point, tried.load, &tried);
  evaluate(work, fit.terms, fit.point, fit.load, &fit);
  return tried.deviance < fit.deviance ? tried : fit;
}

// Evolution around `start` over everything: where a slip comes or does not come with the least
// change of a parameter, there is no slope to follow and no simplex that keeps its shape.
Fit Fitter::evolve(Work& work, const Fit& start, const Evolution& how) const {
  constexpr std::size_t kPopulation = 32;
  const std::vector<double> x = positions(start);
  const double actuator = how.wide ? 0.5 : 0.25;
  std::vector<double> width{0.5, 0.5, actuator, actuator, 0.2};
  for (const double first : first_steps(start)) {
    width.push_back(how.wide ? 0.5 : std::min(0.2, first));
  }
  numeric::Random random(how.seed);
  const auto cost = [&](const std::vector<double>& at) {
    const double value =
        evaluate(work, start.terms, with_positions(start.terms, at), start.load, nullptr);
    return std::isfinite(value) ? value : 1e12;
  };
  std::vector<std::vector<double>> members(kPopulation, x);
  std::vector<double> costs(kPopulation);
  for (std::size_t i = 0; i < kPopulation; ++i) {
    for (std::size_t j = 0; i > 0 && j < x.size(); ++j) {
      members[i][j] = std::clamp(x[j] + width[j] * random.uniform(-1.0, 1.0), 0.0, 1.0);
    }
    costs[i] = cost(members[i]);
  }
  std::array<std::vector<double>, 1> trial;
  std::array<double, 1> trial_cost{};
  const auto first =
      static_cast<std::size_t>(std::min_element(costs.begin(), costs.end()) - costs.begin());
  const std::size_t best = numeric::evolve(
      numeric::Population<std::vector<double>>{members, costs, trial, trial_cost, first},
      {.trials = how.evaluations > kPopulation ? how.evaluations - kPopulation : 0}, random,
      [&](const auto& trials, const auto& trial_costs) { trial_costs[0] = cost(trials[0]); });
  Fit fit = start;
  fit.point = with_positions(fit.terms, members[best]);
  evaluate(work, fit.terms, fit.point, fit.load, &fit);
  return fit;
}

// Levenberg-Marquardt over everything, within the bounds, on what is left when the linear part is
// solved for. Not numeric::least_squares: what must fall is the deviance, with the price of a load
// and of wandering parameters, of which what is left is a part. Where PV jumps with a parameter the
// steps that don't help are not taken.
Fit Fitter::descend(Work& work, const Fit& start, int iterations) const {
  std::vector<double> x = positions(start);
  const auto residual = [&](const std::vector<double>& at, Eigen::VectorXd& r, Fit* fit) {
    const Point point = with_positions(start.terms, at);
    const double deviance = evaluate(work, start.terms, point, start.load, fit);
    const std::size_t n = filters_[start.load].count();
    r = Eigen::Map<const Eigen::VectorXd>(work.target.data(), static_cast<Eigen::Index>(n));
    for (std::size_t i = 0; i < work.white.size(); ++i) {
      r -= work.solved(static_cast<Eigen::Index>(i)) *
           Eigen::Map<const Eigen::VectorXd>(work.white[i].data(), static_cast<Eigen::Index>(n));
    }
    if (fit != nullptr) fit->point = point;
    return deviance;
  };
  Fit best = start;
  Eigen::VectorXd r;
  best.deviance = residual(x, r, &best);
  if (!std::isfinite(best.deviance)) return best;
  using numeric::Parameter;
  std::vector<Parameter> searched(
      kNuisances, Parameter{.low = 0.0, .high = 1.0, .difference = 0.01, .largest_move = 0.5});
  for (const double first : first_steps(start)) {
    searched.push_back(searched.front());
    searched.back().difference = 0.1 * first;
  }
  double damping = 1e-2;
  Eigen::VectorXd there;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    const Eigen::MatrixXd jacobian = numeric::jacobian(
        searched,
        [&](const std::vector<double>& at, Eigen::VectorXd& to) { residual(at, to, nullptr); }, x,
        r);
    const Eigen::MatrixXd normal = jacobian.transpose() * jacobian;
    const Eigen::VectorXd gradient = jacobian.transpose() * r;
    bool better = false;
    for (int attempt = 0; attempt < 5 && !better; ++attempt) {
      const Eigen::VectorXd move = numeric::damped_move(searched, x, normal, gradient, damping);
      if (!move.allFinite()) break;  // a curve or a limit of the reading shows nothing there
      const std::vector<double> y = numeric::moved(searched, x, move);
      Fit tried = best;
      tried.deviance = residual(y, there, &tried);
      if (tried.deviance < best.deviance) {
        better = best.deviance - tried.deviance > 0.02;
        x = y;
        r = there;
        best = tried;
        damping = std::max(damping / 10.0, 1e-6);
        if (!better) return best;
      } else {
        damping *= 8.0;
      }
    }
    if (!better) break;
  }
  return best;
}

Fit Fitter::refine(const Fit& start, int evaluations) const {
  Work work;
  Fit fit = start;
  evaluate(work, fit.terms, fit.point, fit.load, &fit);
  fit = descend(work, fit, 6);
  if (!is_smooth(fit.terms)) fit = descend(work, search(work, fit, evaluations), 4);
  for (int round = 0; round < 2; ++round) {
    const std::size_t before = fit.load;
    choose_load(work, fit);
    if (fit.load == before) break;
    if (!is_smooth(fit.terms)) fit = search(work, fit, evaluations / 2);
    fit = descend(work, fit, 4);
  }
  return fit;
}

Fit Fitter::polish(const Fit& start, const Evolution& how, Fit* close) const {
  if (!jumps(start.terms)) return start;
  Work work;
  Fit best = start;
  Fit fit = start;
  fit.load = kLittleLoad;
  for (const std::size_t part : {std::size_t{1}, std::size_t{2}}) {
    evaluate(work, fit.terms, fit.point, fit.load, &fit);
    fit = descend(work, evolve(work, fit, {how.evaluations / part, how.seed, how.wide}), 4);
    choose_load(work, fit);
    if (fit.deviance < best.deviance) best = fit;
    if (fit.load == kLittleLoad) break;
    if (part == 1 && close != nullptr) *close = search(work, fit, 150);
  }
  return best;
}

Fit Fitter::fit_model() const {
  Fit fit;
  fit.point.time_constant_s = free_run_.model().process.time_constant_s;
  fit.point.dead_time_s = free_run_.model().process.dead_time_s;
  fit.point.actuator_damping = 0.3;
  fit.point.actuator_frequency = allowances_ ? actuator_[1].value(0.3) : 0.0;
  fit.point.friction = 0.3 * healthy_friction_;
  Fit best;
  best.deviance = kInfinity;
  for (const std::size_t load : {kLittleLoad, std::size_t{3}}) {
    fit.load = load;
    const Fit tried = refine(fit, 150);
    if (tried.deviance < best.deviance) best = tried;
  }
  return best;
}

Fit Fitter::settle(const std::vector<Fit>& starts) const {
  Fit best;
  best.deviance = kInfinity;
  for (const Fit& start : starts) {
    const auto searched = static_cast<int>(start.terms.back()->search.size());
    const Fit tried = refine(start, 100 + 15 * searched);
    if (tried.deviance < best.deviance) best = tried;
  }
  return best;
}

Fit Fitter::fit_without(const Fit& fit, std::size_t index, int evaluations) const {
  Fit less = fit;
  const auto at = static_cast<std::ptrdiff_t>(index);
  less.terms.erase(less.terms.begin() + at);
  less.point.searched.erase(less.point.searched.begin() + at);
  return refine(less, evaluations);
}

bool Fitter::tells(const Fit& fit) const {
  const std::span<const double> co(free_run_.output().data(), training_end_);
  for (std::size_t i = 0; i < fit.terms.size(); ++i) {
    if (at_simpler(*fit.terms[i], fit.point.searched[i])) return false;
    if (fit.terms[i]->telling == nullptr) continue;
    const double share =
        fit.terms[i]->telling(fit.point.searched[i], co, free_run_.model().sample_time_s);
    if (share < kLeastTelling) return false;
  }
  return true;
}

bool Fitter::shows_places(const Fit& fit) const {
  const std::span<const double> co(free_run_.output().data(), training_end_);
  for (std::size_t i = 0; i < fit.terms.size(); ++i) {
    const Candidate& term = *fit.terms[i];
    if (term.shows_place != nullptr && !term.shows_place(fit.point.searched[i], co)) return false;
  }
  return true;
}

std::vector<double> Fitter::simulate(const Fit& fit) const {
  std::vector<double> pv = whole(fit);
  free_run_.show(fit.terms, fit.point, pv);
  return pv;
}

std::vector<double> Fitter::whole(const Fit& fit) const {
  std::vector<std::vector<double>> columns;
  free_run_.columns(fit.terms, fit.point, columns);
  std::vector<double> pv = free_run_.offset();
  for (std::size_t i = 0; i < columns.size(); ++i) {
    for (std::size_t k = 0; k < pv.size(); ++k) pv[k] += fit.solved[i] * columns[i][k];
  }
  return pv;
}

std::vector<double> Fitter::innovations(const Fit& fit) const {
  std::vector<double> residual = simulate(fit);
  for (std::size_t k = 0; k < residual.size(); ++k) {
    residual[k] = pv_[k] + free_run_.offset()[k] - residual[k];
  }
  std::vector<double> out(filters_[fit.load].count());
  filters_[fit.load].whiten(residual, out);
  for (double& e : out) e /= fit.noise_rms;
  return out;
}

double Fitter::training_rmse(const Fit& fit) const {
  const std::vector<double> pv = simulate(fit);
  double sum = 0.0;
  for (std::size_t k = 0; k < training_end_; ++k) {
    const double r = used_[k] ? pv_[k] + free_run_.offset()[k] - pv[k] : 0.0;
    sum += r * r;
  }
  return std::sqrt(sum / static_cast<double>(fit.samples));
}

Eigen::MatrixXd Fitter::jacobian(const Fit& fit) const {
  Work work;
  const LoadFilter& filter = filters_[fit.load];
  const auto n = static_cast<Eigen::Index>(filter.count());
  std::vector<double> x = positions(fit);
  const std::size_t searched = x.size();
  const std::size_t solved = fit.solved.size();
  Eigen::MatrixXd jacobian(n, static_cast<Eigen::Index>(searched + solved));
  columns(work, fit.terms, fit.point);
  std::vector<double> white(filter.count());
  if (!free_run_.shows_all(fit.terms)) {
    const std::vector<double> slope = free_run_.slopes(fit.terms, fit.point, whole(fit));
    for (std::vector<double>& column : work.columns) {
      for (std::size_t k = 0; k < training_end_; ++k) column[k] *= slope[k];
    }
  }
  for (std::size_t i = 0; i < solved; ++i) {
    filter.whiten(work.columns[i], white);
    jacobian.col(static_cast<Eigen::Index>(searched + i)) =
        Eigen::Map<const Eigen::VectorXd>(white.data(), n);
  }
  Fit moved = fit;
  for (std::size_t i = 0; i < searched; ++i) {
    const double step = 0.004;
    const double keep = x[i];
    const double up = std::min(1.0, keep + step);
    const double down = std::max(0.0, keep - step);
    x[i] = up;
    moved.point = with_positions(fit.terms, x);
    std::vector<double> difference = simulate(moved);
    x[i] = down;
    moved.point = with_positions(fit.terms, x);
    const std::vector<double> lower = simulate(moved);
    x[i] = keep;
    for (std::size_t k = 0; k < difference.size(); ++k) {
      difference[k] = (difference[k] - lower[k]) / (up - down);
    }
    filter.whiten(difference, white);
    jacobian.col(static_cast<Eigen::Index>(i)) = Eigen::Map<const Eigen::VectorXd>(white.data(), n);
  }
  return jacobian;
}

std::vector<double> Fitter::left_out_innovations(const Fit& fit, std::size_t blocks) const {
  const std::vector<double> e = innovations(fit);
  Eigen::MatrixXd slopes = jacobian(fit) / fit.noise_rms;
  // What stands at a bound stays there.
  const std::vector<double> x = positions(fit);
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (x[i] <= 0.0 || x[i] >= 1.0) slopes.col(static_cast<Eigen::Index>(i)).setZero();
  }
  const double uncertainty = free_run_.model().uncertainty.gain;
  if (!solves_gain(fit.terms) && std::abs(fit.solved[0] - 1.0) >= uncertainty * (1.0 - 1e-9)) {
    slopes.col(static_cast<Eigen::Index>(x.size())).setZero();
  }
  Eigen::MatrixXd whole = slopes.transpose() * slopes;
  // What shows in one block only (the state at the start) is known without it, a little.
  constexpr double kKnown = 0.01;
  whole.diagonal() *= 1.0 + kKnown;
  std::vector<double> out = e;
  for (std::size_t block = 0; block < blocks; ++block) {
    const std::size_t from = block * e.size() / blocks;
    const std::size_t to = (block + 1) * e.size() / blocks;
    const auto rows =
        slopes.middleRows(static_cast<Eigen::Index>(from), static_cast<Eigen::Index>(to - from));
    const Eigen::Map<const Eigen::VectorXd> left(e.data() + from, rows.rows());
    const Eigen::VectorXd moved =
        solve_normal(whole - rows.transpose() * rows, rows.transpose() * left);
    Eigen::Map<Eigen::VectorXd>(out.data() + from, rows.rows()) += rows * moved;
  }
  return out;
}

std::array<double, 2> Fitter::likely_places(const Fit& fit, std::size_t at) const {
  constexpr double kRise = 3.84;  // 95 % of chi squared with one degree of freedom
  Work work;
  std::vector<double> x = positions(fit);
  const double keep = x[at];
  const auto end = [&](double limit) {
    double place = keep;
    for (double step = 0.004; std::abs(place - limit) > 0.0; step *= 1.5) {
      place = std::clamp(place + std::copysign(step, limit - keep), std::min(keep, limit),
                         std::max(keep, limit));
      x[at] = place;
      Fit moved = fit;
      if (evaluate(work, fit.terms, with_positions(fit.terms, x), fit.load, &moved) >
          fit.deviance + kRise) {
        break;
      }
    }
    return place;
  };
  const double low = end(0.0);
  return {low, end(1.0)};
}

Eigen::MatrixXd Fitter::covariance(const Fit& fit) const {
  const Eigen::MatrixXd slopes = jacobian(fit);
  const Eigen::MatrixXd normal = slopes.transpose() * slopes;
  return fit.noise_rms * fit.noise_rms *
         solve_normal(normal, Eigen::MatrixXd::Identity(normal.rows(), normal.cols()));
}

double Fitter::level_spread(const Fit& fit) const {
  if (!free_run_.fits_level()) return 0.0;
  const auto at = static_cast<Eigen::Index>(positions(fit).size() + free_run_.base_columns() - 1);
  return std::sqrt(std::max(0.0, covariance(fit)(at, at)));
}

std::vector<double> Fitter::spread(const Fit& fit, std::size_t index) const {
  const std::vector<double> x = positions(fit);
  const std::size_t searched = x.size();
  const Eigen::MatrixXd covariance = this->covariance(fit);
  std::vector<double> spread;
  std::size_t first = kNuisances;
  std::size_t first_solved = searched + free_run_.base_columns();
  for (std::size_t i = 0; i < index; ++i) {
    first += fit.terms[i]->search.size();
    first_solved += fit.terms[i]->linear_columns();
  }
  const auto deviation = [&](std::size_t i) {
    const auto at = static_cast<Eigen::Index>(i);
    return std::sqrt(std::max(0.0, covariance(at, at)));
  };
  const Candidate& term = *fit.terms[index];
  for (std::size_t j = 0; j < term.search.size(); ++j) {
    const double by = deviation(first + j);
    const effects::SearchRange& range = term.search[j];
    spread.push_back((range.value(x[first + j] + by) - range.value(x[first + j] - by)) / 2.0);
  }
  // A slip more or less makes all slopes of a sticking valve alike: its band is no wider than where
  // it alone is likely.
  if (term.slips) {
    const auto [low, high] = likely_places(fit, first);
    spread[0] =
        std::min(spread[0], (term.search[0].value(high) - term.search[0].value(low)) / (2.0 * k95));
  }
  if (term.solves_gain) spread.push_back(deviation(searched));
  for (std::size_t j = 0; j < term.linear_columns(); ++j) {
    spread.push_back(deviation(first_solved + j));
  }
  return spread;
}

}  // namespace loopwarden::gap
