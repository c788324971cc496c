// SPDX-License-Identifier: Apache-2.0
#include "model/specialist/train/team_training.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/numeric/random.hpp"
#include "model/specialist/judge/limits.hpp"
#include "model/specialist/train/limits.hpp"

namespace loopwarden::specialist {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// no_fault appears twice, because plants are mostly healthy.
constexpr std::array kConditionCycle{
    Condition::no_fault,       Condition::stiction, Condition::backlash, Condition::hysteresis,
    Condition::low_air_supply, Condition::other,    Condition::no_fault};

struct Cases {
  MatrixXd inputs;  // a column for each
  std::vector<Index> condition;
};

struct Moments {
  std::array<Layer, 3> first;
  std::array<Layer, 3> second;
};

struct TeamState {
  std::array<Network, kConditions> networks;
  std::array<Moments, kConditions> moments;
  double steps = 0.0;
};

// Returns the scores, one row per condition.
MatrixXd scores(const std::array<Network, kConditions>& networks, const MatrixXd& inputs) {
  MatrixXd result(static_cast<Index>(kConditions), inputs.cols());
  for (std::size_t c = 0; c < kConditions; ++c) {
    result.row(static_cast<Index>(c)) = networks[c].respond(inputs);
  }
  return result;
}

// Works in place; returns the mean cross-entropy.
double softmax(MatrixXd& scores, const std::vector<Index>& condition, std::size_t from) {
  double entropy = 0.0;
  for (Index k = 0; k < scores.cols(); ++k) {
    auto column = scores.col(k);
    column.array() -= column.maxCoeff();
    column = column.array().exp();
    column /= column.sum();
    entropy -= std::log(std::max(1e-300, column(condition[from + static_cast<std::size_t>(k)])));
  }
  return entropy / static_cast<double>(scores.cols());
}

void adam(Eigen::Ref<MatrixXd> weights, Eigen::Ref<MatrixXd> first, Eigen::Ref<MatrixXd> second,
          const MatrixXd& gradient, double step, double steps) {
  first = TrainLimits::kFirstMoment * first + (1.0 - TrainLimits::kFirstMoment) * gradient;
  second = TrainLimits::kSecondMoment * second +
           (1.0 - TrainLimits::kSecondMoment) * gradient.cwiseAbs2();
  const double a = 1.0 / (1.0 - std::pow(TrainLimits::kFirstMoment, steps));
  const double b = 1.0 / (1.0 - std::pow(TrainLimits::kSecondMoment, steps));
  weights.array() -= step * (a * first.array() / ((b * second.array()).sqrt() + 1e-8) +
                             TrainLimits::kDecay / TrainLimits::kStep * weights.array());
}

// Makes one step of one specialist along its share of the gradient, `left` = p - y.
void learn(Network& n, Moments& m, const MatrixXd& x, const Eigen::RowVectorXd& left, double step,
           double steps) {
  const MatrixXd first = ((n.layers[0].weights * x).colwise() + n.layers[0].bias).array().tanh();
  const MatrixXd second =
      ((n.layers[1].weights * first).colwise() + n.layers[1].bias).array().tanh();
  const MatrixXd delta3 = left / static_cast<double>(x.cols());
  const MatrixXd delta2 =
      (n.layers[2].weights.transpose() * delta3).array() * (1.0 - second.array().square());
  const MatrixXd delta1 =
      (n.layers[1].weights.transpose() * delta2).array() * (1.0 - first.array().square());
  const auto change = [&](std::size_t i, const MatrixXd& delta, const MatrixXd& in) {
    adam(n.layers[i].weights, m.first[i].weights, m.second[i].weights, delta * in.transpose(), step,
         steps);
    adam(n.layers[i].bias, m.first[i].bias, m.second[i].bias, delta.rowwise().sum(), step, steps);
  };
  change(0, delta1, x);
  change(1, delta2, first);
  change(2, delta3, second);
}

double epoch(TeamState& state, const Cases& cases, const std::vector<Index>& order, double step) {
  double sum = 0.0;
  std::size_t batches = 0;
  std::vector<Index> condition(TrainLimits::kBatch);
  for (std::size_t from = 0; from + TrainLimits::kBatch <= order.size();
       from += TrainLimits::kBatch) {
    MatrixXd x(cases.inputs.rows(), static_cast<Index>(TrainLimits::kBatch));
    for (std::size_t k = 0; k < TrainLimits::kBatch; ++k) {
      x.col(static_cast<Index>(k)) = cases.inputs.col(order[from + k]);
      condition[k] = cases.condition[static_cast<std::size_t>(order[from + k])];
    }
    MatrixXd p = scores(state.networks, x);
    sum += softmax(p, condition, 0);
    ++batches;
    for (std::size_t k = 0; k < TrainLimits::kBatch; ++k)
      p(condition[k], static_cast<Index>(k)) -= 1.0;
    ++state.steps;
    for (std::size_t c = 0; c < kConditions; ++c) {
      learn(state.networks[c], state.moments[c], x, p.row(static_cast<Index>(c)), step,
            state.steps);
    }
  }
  return sum / static_cast<double>(std::max<std::size_t>(batches, 1));
}

TeamRestart run_restart(const Cases& training, const Cases& validation,
                        const TeamTrainingSettings& settings, std::size_t restart,
                        const TeamHooks& hooks) {
  numeric::Random random(stream_seed(settings.seed, 0x7e57 + restart));
  const NetworkShape shape{kNetworkInputs, settings.hidden, settings.hidden, 1};
  TeamState state;
  for (std::size_t c = 0; c < kConditions; ++c) {
    state.networks[c] = random_network(shape, random.bits());
    state.moments[c] = {Network(shape).layers, Network(shape).layers};
  }
  std::vector<Index> order(static_cast<std::size_t>(training.inputs.cols()));
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = static_cast<Index>(k);
  TeamRestart best;
  best.validation = std::numeric_limits<double>::infinity();
  std::size_t since_best = 0;
  for (std::size_t e = 0; e < settings.most_epochs && since_best < settings.patience; ++e) {
    for (std::size_t k = order.size(); k > 1; --k) {
      std::swap(order[k - 1], order[static_cast<std::size_t>(random.bits() % k)]);
    }
    const double done = static_cast<double>(e) / static_cast<double>(settings.most_epochs);
    TeamEpoch now{restart, e,
                  epoch(state, training, order, TrainLimits::kStep * (1.0 - 0.9 * done)), 0.0};
    MatrixXd p = scores(state.networks, validation.inputs);
    now.validation = softmax(p, validation.condition, 0);
    best.epochs.push_back(now);
    if (hooks.epoch) hooks.epoch(now);
    ++since_best;
    if (now.validation < best.validation) {
      best.validation = now.validation;
      best.networks = state.networks;
      since_best = 0;
    }
  }
  return best;
}

// Returns the temperature with the least cross-entropy, by golden section on its logarithm.
double fit_temperature(const MatrixXd& scores, const Cases& cases, double& entropy) {
  const auto at = [&](double log_temperature) {
    MatrixXd p = scores / std::exp(log_temperature);
    return softmax(p, cases.condition, 0);
  };
  double low = -1.5;
  double high = 1.5;
  constexpr double kGolden = 0.6180339887498949;
  for (int i = 0; i < 30; ++i) {
    const double a = high - kGolden * (high - low);
    const double b = low + kGolden * (high - low);
    if (at(a) < at(b)) {
      high = b;
    } else {
      low = a;
    }
  }
  entropy = at(0.5 * (low + high));
  return std::exp(0.5 * (low + high));
}

Cases cases_of(const std::vector<Example>& examples, std::size_t from, std::size_t to,
               const Team& team) {
  Cases cases;
  cases.inputs.resize(static_cast<Index>(kNetworkInputs), static_cast<Index>(to - from));
  for (std::size_t k = from; k < to; ++k) {
    for (std::size_t i = 0; i < kNetworkInputs; ++i) {
      cases.inputs(static_cast<Index>(i), static_cast<Index>(k - from)) =
          (examples[k].inputs[i] - team.centre[i]) / team.scale[i];
    }
    cases.condition.push_back(static_cast<Index>(examples[k].condition));
  }
  return cases;
}

void standardise(const std::vector<Example>& examples, std::size_t count, Team& team) {
  const auto n = static_cast<double>(count);
  for (std::size_t i = 0; i < kNetworkInputs; ++i) {
    double sum = 0.0;
    double squares = 0.0;
    for (std::size_t k = 0; k < count; ++k) sum += examples[k].inputs[i];
    team.centre[i] = sum / n;
    for (std::size_t k = 0; k < count; ++k) {
      const double d = examples[k].inputs[i] - team.centre[i];
      squares += d * d;
    }
    team.scale[i] = std::max(1e-3, std::sqrt(squares / n));
  }
}

}  // namespace

std::uint64_t stream_seed(std::uint64_t seed, std::uint64_t k) noexcept {
  numeric::Random random(seed * 0x9e3779b97f4a7c15ULL + k);
  return random.bits();
}

std::vector<Example> simulate_examples(const plant::LoopModel& model, std::size_t count,
                                       std::uint64_t seed, const ParallelFor& parallel_for,
                                       std::size_t first) {
  constexpr std::size_t kChunk = 64;
  std::vector<Example> examples(count);
  parallel_for((count + kChunk - 1) / kChunk, [&](std::size_t chunk) {
    WindowFitter fitter(facts_of(model));
    for (std::size_t k = chunk * kChunk; k < std::min(count, (chunk + 1) * kChunk); ++k) {
      for (int attempt = 0; attempt < TrainLimits::kMostTries; ++attempt) {
        const std::size_t number = first + k;
        const WindowRequest request{.condition = kConditionCycle[number % kConditionCycle.size()]};
        const SimulatedWindow window =
            simulate_window(model, request,
                            stream_seed(seed, TrainLimits::kMostTries * number +
                                                  static_cast<std::size_t>(attempt)));
        const WindowFits found = fitter.fit(window.view());
        // Operators don't leave a loop at the limits of its output for long.
        if (!found.usable || found.shut_share > JudgeLimits::kMostShut) continue;
        examples[k] = {network_inputs_of(found), window.condition,
                       std::log(misfit_of(found, window.condition) / (found.noise * found.noise))};
        break;
      }
    }
  });
  return examples;
}

TeamTraining train_team(const LoopFacts& facts, const std::vector<Example>& examples,
                        const TeamTrainingSettings& settings, const ParallelFor& parallel_for,
                        const TeamHooks& hooks) {
  TeamTraining result;
  Team& team = result.team;
  team.facts = facts;
  const std::size_t training_count = examples.size() - examples.size() / 10;
  standardise(examples, training_count, team);
  const Cases training = cases_of(examples, 0, training_count, team);
  const Cases validation = cases_of(examples, training_count, examples.size(), team);
  std::vector<TeamRestart> restarts(settings.restarts);
  parallel_for(settings.restarts, [&](std::size_t r) {
    if (hooks.find) {
      if (std::optional<TeamRestart> found = hooks.find(r)) {
        restarts[r] = std::move(*found);
        return;
      }
    }
    restarts[r] = run_restart(training, validation, settings, r, hooks);
    if (hooks.finished) hooks.finished(r, restarts[r]);
  });
  const TeamRestart* best = &restarts.front();
  for (const TeamRestart& restart : restarts) {
    if (restart.validation < best->validation) best = &restart;
    result.epochs.insert(result.epochs.end(), restart.epochs.begin(), restart.epochs.end());
  }
  team.temperature =
      fit_temperature(scores(best->networks, validation.inputs), validation, result.validation);
  for (std::size_t c = 0; c < kConditions; ++c) {
    TeamMember& member = team.members[c];
    member.condition = static_cast<Condition>(c);
    member.network = best->networks[c];
    std::vector<double> misfits;
    for (const Example& e : examples) {
      if (e.condition == member.condition) misfits.push_back(e.log_misfit);
    }
    std::sort(misfits.begin(), misfits.end());
    if (misfits.empty()) continue;
    const auto place = static_cast<std::size_t>(JudgeLimits::kMisfitQuantile *
                                                static_cast<double>(misfits.size() - 1));
    member.most_misfit = misfits[place];
  }
  return result;
}

}  // namespace loopwarden::specialist
