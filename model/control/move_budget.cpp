// SPDX-License-Identifier: Apache-2.0
#include "model/control/move_budget.hpp"

#include <algorithm>
#include <cmath>

#include "model/control/planned_moves_limits.hpp"

namespace loopwarden::control {

using Limits = PlannedMovesLimits;

LastHour::LastHour(double max_per_hour) noexcept
    : part_s_(60.0 / std::min(1.0, max_per_hour)), most_(std::max(1.0, std::floor(max_per_hour))) {}

void LastHour::pass(double period_s) noexcept {
  for (since_s_ += period_s; since_s_ >= part_s_; since_s_ -= part_s_) {
    newest_ = (newest_ + 1) % parts_.size();
    made_ -= static_cast<double>(parts_[newest_]);
    parts_[newest_] = 0.0F;
  }
}

void LastHour::add() noexcept {
  made_ += 1.0;
  parts_[newest_] += 1.0F;
}

void LastHour::take_over(const LastHour& other) noexcept {
  const LastHour limit = *this;
  *this = other;
  most_ = limit.most_;
  if (part_s_ == limit.part_s_) return;
  // The ages within parts of another length are not known: all moves count as new.
  part_s_ = limit.part_s_;
  parts_.fill(0.0F);
  parts_[newest_] = static_cast<float>(made_);
  since_s_ = 0.0;
}

MoveBudget::MoveBudget(double max_moves_per_hour, double period_s) noexcept
    : max_moves_per_hour_(max_moves_per_hour),
      period_s_(period_s),
      hour_(max_moves_per_hour),
      acted_(max_moves_per_hour) {}

void MoveBudget::continue_hour(const MoveBudget& before, bool shadow) noexcept {
  acted_.take_over(before.acted_);
  if (!shadow) hour_ = acted_;
}

void MoveBudget::restart(double j) noexcept {
  tokens_ = Limits::kTokens;
  travel_ = Limits::kFirstTravel * j;
}

void MoveBudget::pass() noexcept {
  tokens_ = std::min(tokens_ + max_moves_per_hour_ * period_s_ / 3600.0,
                     std::max(Limits::kTokens, max_moves_per_hour_ / Limits::kTokenHours));
  hour_.pass(period_s_);
  acted_.pass(period_s_);
}

void MoveBudget::count(bool shadow) noexcept {
  hour_.add();
  if (!shadow) acted_.add();
}

void MoveBudget::earn_travel(const LoopBaseline& baseline, double j) noexcept {
  travel_ = std::min(travel_ + Limits::kTravel * baseline.travel_rate * period_s_,
                     Limits::kMostTravel * j);
}

void MoveBudget::spend_travel(double travel, double j) noexcept {
  travel_ = std::max(travel_ - travel, -Limits::kMostOverdraft * j);
}

}  // namespace loopwarden::control
