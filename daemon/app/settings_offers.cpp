// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/settings_offers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <utility>

namespace loopwarden::daemon {

using reload::Decision;
using reload::LoopPlan;

bool SettingsOffers::offered(const LoopPlan& plan) noexcept {
  return (plan.decision == Decision::apply || plan.decision == Decision::wait_for_output) &&
         !(plan.keys.applied.empty() && plan.waiting_for_output.empty());
}

// Steps that may fail are first, so that the plan is carried out as a whole.
void SettingsOffers::make(const reload::Plan& plan, const config::Configuration& wanted) {
  std::vector<Offer> offers;
  for (std::size_t k = 0; k < plan.loops.size(); ++k) {
    const LoopPlan& planned = plan.loops[k];
    if (!offered(planned)) continue;
    const std::size_t loop = find_loop(loops_, planned.loop).value();
    const auto config =
        std::find_if(wanted.loops.begin(), wanted.loops.end(),
                     [&](const config::LoopConfig& c) { return c.name == planned.loop; });
    offers.push_back({.loop = loop,
                      .plan_loop = k,
                      .number = 0,
                      .judged = false,
                      .taken = false,
                      .out_of_service = false,
                      .wanted = *config});
  }
  withdrawn_.reserve(withdrawn_.size() + offers_.size());
  for (const Offer& old : std::exchange(offers_, {})) {
    const std::uint32_t number = ++newest_[old.loop];
    loops_[old.loop].channels->settings.publish(
        {.settings = {}, .number = number, .withdrawn = true});
    withdrawn_.push_back({.loop = old.loop,
                          .number = old.number,
                          .after = number,
                          .gains = old.wanted.controller.pid.gains});
  }
  for (Offer& offer : offers) {
    const LoopRuntime& loop = loops_[offer.loop];
    offer.number = ++newest_[offer.loop];
    loop.channels->settings.publish(
        {.settings = settings_of(offer.wanted, config::backing_of(loop.config.io)),
         .number = offer.number});
  }
  offers_ = std::move(offers);
}

std::string SettingsOffers::why_held(const Offer& offer, const reload::Output& output) const {
  if (const auto holder = loops_[offer.loop].commissioning->holder()) {
    return fmt::format("until its commissioning by {} has ended", holder->by);
  }
  return reload::why_held(offer.wanted, output);
}

bool SettingsOffers::withdrawn_taken() {
  bool taken = false;
  std::erase_if(withdrawn_, [&](const Withdrawn& old) {
    const rt::LoopChannels& channels = *loops_[old.loop].channels;
    // The order matters: a cycle that has seen the newer offer never takes an older one.
    const bool seen = channels.settings_seen.load(std::memory_order_acquire) >= old.after;
    if (channels.settings_taken.load(std::memory_order_acquire) != old.number) return seen;
    loops_[old.loop].settings->gains_of_file(old.gains);
    taken = true;
    return true;
  });
  return taken;
}

SettingsOffers::Followed SettingsOffers::follow(
    reload::Plan& plan, const std::function<reload::Output(std::size_t loop)>& output,
    const std::function<void(const std::string& loop)>& in_force) {
  Followed followed{.taken_after = withdrawn_taken()};
  for (Offer& offer : offers_) {
    const rt::LoopChannels& channels = *loops_[offer.loop].channels;
    LoopPlan& planned = plan.loops[offer.plan_loop];
    if (channels.settings_taken.load(std::memory_order_acquire) == offer.number) {
      const bool waited = planned.decision == Decision::wait_for_output;
      reload::confirm(planned);
      loops_[offer.loop].settings->gains_of_file(offer.wanted.controller.pid.gains);
      if (waited) in_force(planned.loop);
      offer.taken = true;
      followed.changed = true;
    } else if (channels.settings_waiting.load(std::memory_order_acquire) == offer.number) {
      const bool out_of_service = loops_[offer.loop].commissioning->holder().has_value();
      if (offer.judged && offer.out_of_service == out_of_service) continue;
      offer.judged = true;
      offer.out_of_service = out_of_service;
      reload::hold(planned, why_held(offer, output(offer.loop)));
      followed.changed = true;
    }
  }
  std::erase_if(offers_, [](const Offer& offer) { return offer.taken; });
  return followed;
}

bool SettingsOffers::all_judged() const noexcept {
  return std::all_of(offers_.begin(), offers_.end(),
                     [](const Offer& offer) { return offer.judged; });
}

void SettingsOffers::hold_unjudged(reload::Plan& plan) const {
  for (const Offer& offer : offers_) {
    LoopPlan& planned = plan.loops[offer.plan_loop];
    if (offer.judged || planned.keys.applied.empty()) continue;
    reload::hold(planned, fmt::format("for the loop's next cycle, at most {:g} s away",
                                      offer.wanted.sample_time_s));
  }
}

}  // namespace loopwarden::daemon
