// SPDX-License-Identifier: Apache-2.0
#include "model/control/compensator.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace loopwarden::control {
namespace {

// Calls `f` with the present law. Unlike std::visit it cannot throw.
template <class Variant, class F>
void with_law(Variant& law, F&& f) noexcept {
  [&]<std::size_t... I>(std::index_sequence<I...>) {
    (void)((law.index() == I ? (f(*std::get_if<I>(&law)), true) : false) || ...);
  }
  (std::make_index_sequence<std::variant_size_v<Variant>>{});
}

}  // namespace

Compensator::Law Compensator::law_of(const CompensatorSettings& settings,
                                     double period_s) noexcept {
  switch (settings.kind) {
    case CompensatorKind::none:
    case CompensatorKind::planned_moves: break;
    case CompensatorKind::knocker: return Knocker(settings, period_s);
    case CompensatorKind::two_move: return TwoMove(settings, period_s);
    case CompensatorKind::reinforcement: return Reinforcement(settings, period_s);
    case CompensatorKind::backlash: return BacklashCompensator(settings, period_s);
    case CompensatorKind::hysteresis: return HysteresisInverse(settings, period_s);
  }
  return None{};
}

Compensator::Compensator(const CompensatorSettings& settings, double period_s) noexcept
    : settings_(settings), period_s_(period_s), law_(law_of(settings, period_s)) {}

void Compensator::configure(const CompensatorSettings& settings) noexcept {
  const bool was_shadow = std::exchange(settings_.shadow, false);
  const bool begins_to_act = was_shadow && settings_ == settings;
  settings_ = settings;
  if (begins_to_act && settings.kind == CompensatorKind::planned_moves) return;
  law_ = law_of(settings, period_s_);
  fresh_ = true;
}

Correction Compensator::step(const CompensatorInputs& in, const MovesRequest& request) noexcept {
  if (settings_.kind == CompensatorKind::none) return {};
  if (!std::isfinite(in.output) || !std::isfinite(in.error)) return {};
  Correction wanted;
  if (settings_.kind == CompensatorKind::planned_moves) {
    if (fresh_) hold_.restart();
    wanted = hold_.step(in, request, settings_);
  } else {
    with_law(law_, [&](auto& law) {
      if (fresh_) law.reset(in.output);
      wanted = law.step(in);
    });
  }
  fresh_ = false;
  wanted.added = std::clamp(wanted.added, -settings_.limit, settings_.limit);
  return wanted;
}

}  // namespace loopwarden::control
