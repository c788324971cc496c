// SPDX-License-Identifier: Apache-2.0
#include "daemon/rt/output_knowledge.hpp"

namespace loopwarden::daemon::rt {

using control::Fault;
using Kind = control::OutputAction::Kind;

std::optional<double> OutputKnowledge::update(const Cycle& cycle) noexcept {
  withhold(cycle);
  invalidate(cycle);
  if (valid_ || withheld_) return std::nullopt;
  const std::optional<double> position = find(cycle);
  if (position) valid_ = ever_valid_ = true;
  return position;
}

bool OutputKnowledge::report() noexcept {
  if (valid_) return false;
  valid_ = ever_valid_ = reported_ = true;
  return true;
}

void OutputKnowledge::withhold(const Cycle& cycle) noexcept {
  if (cycle.withhold) {
    if (!withheld_) valid_before_withheld_ = valid_;
    valid_ = reported_ = false;
    invalid_since_ns_ = cycle.now_ns;
  } else if (withheld_ && !cycle.read_back.fitted) {
    valid_ = valid_ || valid_before_withheld_;
  }
  withheld_ = cycle.withhold;
}

void OutputKnowledge::invalidate(const Cycle& cycle) noexcept {
  const bool lost = cycle.output_lost || cycle.late_cycle;
  if (cycle.late_cycle || (lost && !lost_)) {
    invalid_since_ns_ = cycle.now_ns;
    reported_ = false;
  }
  lost_ = lost;
  // A fault lasts longer than its cause. A position that is reported meanwhile stays valid.
  const bool in_doubt = lost || cycle.fault == Fault::output_lost ||
                        cycle.fault == Fault::late_cycle ||
                        (cycle.fault == Fault::starting && !command_written_);
  if (in_doubt && cycle.read_back.fitted && !reported_) valid_ = false;
}

std::optional<double> OutputKnowledge::find(const Cycle& cycle) const noexcept {
  const ReadBack& read_back = cycle.read_back;
  if (read_back.good && read_back.time_ns >= invalid_since_ns_) return read_back.value;
  if (cycle.fault == Fault::stop && cycle.action.kind == Kind::value) {
    // A ramp would start at a guess: a read-back gets its time first.
    const double invalid_s = static_cast<double>(cycle.now_ns - invalid_since_ns_) * 1e-9;
    if (read_back.fitted && invalid_s <= cycle.max_age_s) return std::nullopt;
    return cycle.action.value;
  }
  if (!ever_valid_ && cycle.started && at_start_.kind == Kind::value) return at_start_.value;
  return std::nullopt;
}

}  // namespace loopwarden::daemon::rt
