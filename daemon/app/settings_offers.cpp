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

// All that may fail comes first: the plan is carried out as a whole.
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
                      .wanted = *config});
  }
  for (const Offer& old : std::exchange(offers_, {})) {
    loops_[old.loop].channels->settings.publish(
        {.settings = {}, .number = ++newest_[old.loop], .withdrawn = true});
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

bool SettingsOffers::follow(reload::Plan& plan,
                            const std::function<reload::Output(std::size_t loop)>& output,
                            const std::function<void(const std::string& loop)>& in_force) {
  bool changed = false;
  for (Offer& offer : offers_) {
    const rt::LoopChannels& channels = *loops_[offer.loop].channels;
    LoopPlan& planned = plan.loops[offer.plan_loop];
    if (channels.settings_taken.load(std::memory_order_acquire) == offer.number) {
      const bool waited = planned.decision == Decision::wait_for_output;
      reload::confirm(planned);
      loops_[offer.loop].settings->gains_of_file(offer.wanted.controller.pid.gains);
      if (waited) in_force(planned.loop);
      offer.taken = true;
      changed = true;
    } else if (!offer.judged &&
               channels.settings_waiting.load(std::memory_order_acquire) == offer.number) {
      offer.judged = true;
      reload::hold(planned, reload::why_held(offer.wanted, output(offer.loop)));
      changed = true;
    }
  }
  std::erase_if(offers_, [](const Offer& offer) { return offer.taken; });
  return changed;
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
