// SPDX-License-Identifier: Apache-2.0
#include "model/specialist/train/growing.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <stdexcept>

#include "model/numeric/random.hpp"
#include "model/plant/simulated_loop.hpp"
#include "model/specialist/train/limits.hpp"
#include "model/specialist/train/team_training.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::specialist {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

Lessons lessons_of(const std::vector<Signature>& signatures, Condition condition, Role role,
                   const SignatureMatrix& target, const Scaling& scaling) {
  std::vector<const Signature*> chosen;
  for (const Signature& s : signatures) {
    if (s.condition == condition && s.role == role) chosen.push_back(&s);
  }
  const auto side = static_cast<Index>(kSide);
  Lessons lessons{MatrixXd(side, side * static_cast<Index>(chosen.size())),
                  MatrixXd(side, side * static_cast<Index>(chosen.size()))};
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    lessons.inputs.middleCols(static_cast<Index>(i) * side, side) =
        signature_matrix(chosen[i]->pv, scaling);
    lessons.targets.middleCols(static_cast<Index>(i) * side, side) = target;
  }
  return lessons;
}

std::vector<double> mean_of(const std::vector<Signature>& signatures, Condition condition) {
  std::vector<double> mean(kSignatureSamples, 0.0);
  double count = 0.0;
  for (const Signature& s : signatures) {
    if (s.condition != condition) continue;
    ++count;
    for (std::size_t k = 0; k < kSignatureSamples; ++k) mean[k] += s.pv[k];
  }
  for (double& value : mean) value /= std::max(count, 1.0);
  return count > 0.0 ? mean : std::vector<double>{};
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return sum;
}

// Mean and strongest directions of the training columns.
struct Components {
  Eigen::VectorXd mean;
  MatrixXd directions;  // inputs x components
};

Components components_of(const MatrixXd& columns, std::size_t count) {
  Components result;
  result.mean = columns.rowwise().mean();
  const MatrixXd centred = columns.colwise() - result.mean;
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(centred * centred.transpose());
  result.directions = solver.eigenvectors().rightCols(static_cast<Index>(count));
  return result;
}

Lessons reduced(const Lessons& lessons, const Components& components) {
  return {components.directions.transpose() * (lessons.inputs.colwise() - components.mean),
          lessons.targets};
}

// Returns the same function with the columns themselves as inputs.
Network on_columns(const Network& network, const Components& components) {
  Network result = network;
  result.layers[0].weights = network.layers[0].weights * components.directions.transpose();
  result.layers[0].bias = network.layers[0].bias - result.layers[0].weights * components.mean;
  return result;
}

}  // namespace

const char* to_text(Role role) noexcept {
  return numeric::enum_name<Role::test>(role, {"training", "validation", "test"});
}

Role role_of(std::size_t place) noexcept {
  constexpr std::array kOrder{Role::training, Role::validation, Role::training, Role::test,
                              Role::training};
  return kOrder[place % kOrder.size()];
}

std::size_t target_of(const std::vector<Signature>& signatures, Condition condition) {
  const std::vector<double> healthy = mean_of(signatures, Condition::no_fault);
  const std::vector<double> own = mean_of(signatures, condition);
  std::size_t best = signatures.size();
  double strongest = 0.0;
  for (std::size_t i = 0; i < signatures.size(); ++i) {
    const Signature& s = signatures[i];
    if (s.condition != condition) continue;
    double strength = s.severity_percent;
    if (condition == Condition::no_fault || healthy.empty()) {
      strength = -distance(s.pv, own);
    } else if (strength == 0.0) {
      strength = distance(s.pv, healthy);
    }
    if (best == signatures.size() || strength > strongest) {
      strongest = strength;
      best = i;
    }
  }
  return best;
}

Signature simulate_signature(const plant::LoopModel& believed, Condition condition,
                             std::uint64_t seed) {
  numeric::Random random(seed);
  plant::LoopModel m = believed;
  const control::PidSettings& pid = believed.controller.pid;
  const double co_span = pid.output_span();
  const double pv_span = m.transmitter.span();
  m.controller.pid.gains.kp *= random.uniform(0.9, 1.1);
  m.controller.pid.gains.ki *= random.uniform(0.9, 1.1);
  if (m.transmitter.noise == 0.0) m.transmitter.noise = 0.001 * pv_span;
  // From a valve that is nearly shut to the middle, like the thesis's step to 5 L/min.
  const double level = m.process.level.value_or(0.0);
  const double at_low = level + m.process.gain * (pid.output_low + 0.02 * co_span);
  const double goal = level + m.process.gain * (pid.output_low + 0.41 * co_span);
  const auto within = [&](double pv) {
    return std::clamp(pv, m.transmitter.low, m.transmitter.high);
  };
  m.scenario.set_point = {{0.0, within(at_low)}, {m.sample_time_s, within(goal)}};
  m.scenario.faults.clear();
  m.scenario.seed = random.bits();
  double percent = 0.0;
  const double unit = 0.01 * co_span;
  switch (condition) {
    case Condition::stiction: {
      percent = random.uniform(6.0, 16.0);
      m.valve_effects.push_back({"stiction", {{"s", percent * unit}, {"j", 0.4 * percent * unit}}});
      break;
    }
    case Condition::backlash:
      percent = random.uniform(6.0, 16.0);
      m.valve_effects.push_back({"backlash", {{"deadband", percent * unit}}});
      break;
    case Condition::hysteresis:
      // Noise reverses the thesis's block at every sample, as in the thesis.
      percent = random.uniform(4.0, 10.0);
      m.valve_effects.push_back({"hysteresis", {{"offset", percent * unit}}});
      break;
    case Condition::low_air_supply: {
      // Slower is worse: a rate of 1 %/s gives a severity of 1.
      const double rate = random.uniform(1.2, 2.4);
      percent = 1.0 / rate;
      m.valve_effects.push_back({"low_air_supply", {{"rate", rate * unit}, {"lag", 1.0}}});
      break;
    }
    case Condition::no_fault:
    case Condition::other: break;
  }
  plant::SimulatedLoop loop(m, co_span / 4096.0);
  Signature signature;
  signature.condition = condition;
  signature.severity_percent = percent;
  for (std::size_t k = 0; k < kSignatureSamples; ++k) {
    const plant::LoopSample sample = loop.step();
    signature.pv.push_back(sample.pv);
    signature.co.push_back(sample.co);
  }
  return signature;
}

Grown grow(const std::vector<Signature>& signatures, Condition condition, const Scaling& scaling,
           const GrowingSettings& settings, const GrowingHooks& hooks) {
  const std::size_t target = target_of(signatures, condition);
  if (target == signatures.size()) throw std::invalid_argument("no signature of this condition");
  Grown grown;
  grown.specialist.condition = condition;
  grown.specialist.scaling = scaling;
  grown.specialist.target = signatures[target].pv;
  const SignatureMatrix goal = signature_matrix(signatures[target].pv, scaling);
  std::array<Lessons, 3> lessons;
  for (const Role role : {Role::training, Role::validation, Role::test}) {
    lessons[static_cast<std::size_t>(role)] =
        lessons_of(signatures, condition, role, goal, scaling);
    if (role != Role::test && lessons[static_cast<std::size_t>(role)].inputs.cols() == 0) {
      throw std::invalid_argument(std::string("no ") + to_text(role) + " signature");
    }
  }
  Components components;
  const bool reduce = settings.components < kSide;
  if (reduce) {
    components = components_of(lessons[0].inputs, settings.components);
    for (Lessons& l : lessons) l = reduced(l, components);
  }
  double least = 0.0;
  for (const std::size_t size : settings.sizes) {
    GrownSize best{size, {}};
    for (std::size_t restart = 0; restart < settings.restarts; ++restart) {
      std::optional<Learned> found = hooks.find ? hooks.find(size, restart) : std::nullopt;
      if (!found) {
        const NetworkShape shape{settings.components, size, size, kSide};
        const std::uint64_t stream =
            (static_cast<std::uint64_t>(condition) * 64 + size) * 64 + restart;
        found =
            learn(random_network(shape, stream_seed(settings.seed, stream)), lessons[0], lessons[1],
                  lessons[2], settings.learning, [&](std::size_t epoch, const Epoch& e) {
                    if (hooks.epoch) hooks.epoch(size, restart, epoch, e);
                  });
        if (hooks.finished) hooks.finished(size, restart, *found);
      }
      Learned learned = std::move(*found);
      if (restart == 0 || learned.epochs[learned.best].validation <
                              best.learned.epochs[best.learned.best].validation) {
        best.learned = std::move(learned);
      }
    }
    const double validation = best.learned.epochs[best.learned.best].validation;
    const bool better = grown.sizes.empty() || validation < least;
    const bool worthwhile =
        grown.sizes.empty() || validation < (1.0 - TrainLimits::kWorthwhile) * least;
    if (better) {
      least = validation;
      grown.chosen = grown.sizes.size();
    }
    grown.sizes.push_back(std::move(best));
    if (!worthwhile) break;
  }
  const Network& chosen = grown.sizes[grown.chosen].learned.network;
  grown.specialist.network = reduce ? on_columns(chosen, components) : chosen;
  return grown;
}

}  // namespace loopwarden::specialist
