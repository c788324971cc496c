// SPDX-License-Identifier: Apache-2.0
#include "model/specialist/judge/team.hpp"

#include <algorithm>
#include <cmath>

#include "model/specialist/judge/limits.hpp"

namespace loopwarden::specialist {
namespace {

constexpr std::size_t index_of(Condition c) noexcept { return static_cast<std::size_t>(c); }

bool offset_fits_better(const WindowFits& f) noexcept {
  return f.of(FaultModel::hysteresis_offset).mse < f.of(FaultModel::hysteresis_width).mse;
}

const FaultFit& hysteresis_of(const WindowFits& f) noexcept {
  return f.of(offset_fits_better(f) ? FaultModel::hysteresis_offset : FaultModel::hysteresis_width);
}

}  // namespace

double misfit_of(const WindowFits& f, Condition condition) noexcept {
  switch (condition) {
    case Condition::no_fault: return f.of(FaultModel::healthy).mse;
    case Condition::stiction: return f.of(FaultModel::stiction).mse;
    case Condition::backlash: return f.of(FaultModel::backlash).mse;
    case Condition::hysteresis: return hysteresis_of(f).mse;
    case Condition::low_air_supply: return f.of(FaultModel::low_air_supply).mse;
    case Condition::other: break;
  }
  return f.of(FaultModel::other_process).mse;
}

double severity_of(const WindowFits& f, Condition condition) noexcept {
  // If CO never took the stem out of its backlash or friction, the fault left no trace.
  const double crossed = f.co_range;
  // An offset, or a stem that is still moving, is visible in PV as well.
  const double seen = std::max(f.co_range, f.pv_range);
  switch (condition) {
    case Condition::stiction: return std::min(f.of(FaultModel::stiction).size, crossed);
    case Condition::backlash: return std::min(f.of(FaultModel::backlash).size, crossed);
    case Condition::hysteresis: {
      const double size = std::abs(hysteresis_of(f).size);
      return std::min(size, offset_fits_better(f) ? seen : crossed);
    }
    case Condition::low_air_supply: return std::min(f.of(FaultModel::low_air_supply).size, seen);
    case Condition::no_fault:
    case Condition::other: break;
  }
  return 0.0;
}

TeamJudge::TeamJudge(const Team& team)
    : fitter_(team.facts),
      centre_(team.centre),
      scale_(team.scale),
      temperature_(team.temperature) {
  for (const TeamMember& member : team.members) {
    most_misfit_[index_of(member.condition)] = member.most_misfit;
    responders_.emplace_back(member.network);
  }
}

WindowVerdict TeamJudge::judge(const numeric::LoopView& window) noexcept {
  return judge(fitter_.fit(window));
}

WindowVerdict TeamJudge::judge(const WindowFits& found) noexcept {
  WindowVerdict result;
  if (!found.usable || found.shut_share > JudgeLimits::kMostShut) return result;
  NetworkInputs inputs = network_inputs_of(found);
  for (std::size_t i = 0; i < kNetworkInputs; ++i) {
    inputs[i] = (inputs[i] - centre_[i]) / scale_[i];
  }
  double highest = -1e300;
  for (std::size_t c = 0; c < kConditions; ++c) {
    const double score = responders_[c].respond(inputs)[0] / temperature_;
    result.probabilities[c] = score;
    highest = std::max(highest, score);
    result.mse[c] = misfit_of(found, static_cast<Condition>(c));
  }
  double sum = 0.0;
  for (double& p : result.probabilities) sum += p = std::exp(p - highest);
  for (double& p : result.probabilities) p /= sum;

  const double healthy = result.probabilities[index_of(Condition::no_fault)];
  const double other = result.probabilities[index_of(Condition::other)];
  Condition best = Condition::stiction;
  for (std::size_t c = index_of(Condition::stiction); c < kKnownConditions; ++c) {
    if (result.probabilities[c] > result.probabilities[index_of(best)]) {
      best = static_cast<Condition>(c);
    }
  }
  const auto fits = [&](Condition c) {
    return std::log(result.mse[index_of(c)] / (found.noise * found.noise)) <=
           most_misfit_[index_of(c)];
  };
  const auto at_least = [&](Condition c, double p) {
    return result.probabilities[index_of(c)] >= p && fits(c);
  };
  const bool moved = found.co_range > JudgeLimits::kLeastMovement * found.noise;
  bool explained = false;
  for (std::size_t c = 0; c < kKnownConditions; ++c) {
    explained = explained || fits(static_cast<Condition>(c));
  }
  if (1.0 - healthy - other >= JudgeLimits::kFault && at_least(best, JudgeLimits::kNamed)) {
    result.verdict = static_cast<VerdictName>(best);
    result.probability = result.probabilities[index_of(best)];
    result.severity_percent = severity_of(found, best);
  } else if (moved && at_least(Condition::no_fault, JudgeLimits::kNoFault)) {
    result.verdict = VerdictName::no_fault;
    result.probability = healthy;
  } else if (moved && (other >= JudgeLimits::kUnknown || !explained)) {
    result.verdict = VerdictName::unknown;
    result.probability = other;
  } else {
    result.verdict = VerdictName::not_enough_movement;
    result.probability = std::max(healthy, result.probabilities[index_of(best)]);
  }
  return result;
}

}  // namespace loopwarden::specialist
