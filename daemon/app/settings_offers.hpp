// SPDX-License-Identifier: Apache-2.0
// Passes settings from a plan to the loops' cycles. For the main thread only.
//
// A cycle may take an offer at the moment when a newer plan withdraws it. Every withdrawn offer is
// tracked until the cycle has either taken it or seen the withdrawal. So no taken offer is missed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "config/loop_config.hpp"
#include "daemon/app/reload.hpp"
#include "daemon/loops/loop_runtime.hpp"

namespace loopwarden::daemon {

class SettingsOffers {
 public:
  // `count`: number of loops. `loops` may be filled later, before make().
  SettingsOffers(const std::vector<LoopRuntime>& loops, std::size_t count)
      : loops_(loops), newest_(count, 0) {}

  // Offers each loop the settings that the plan applies. Waiting offers of an earlier plan are
  // replaced or withdrawn.
  void make(const reload::Plan& plan, const config::Configuration& wanted);
  struct Followed {
    bool changed = false;  // the plan has changed
    // a withdrawn offer is in force, although the plan was made without it
    bool taken_after = false;
  };
  // Updates the plan with the cycles' results. `in_force`: called for a loop whose settings had
  // waited for its output.
  Followed follow(reload::Plan& plan, const std::function<reload::Output(std::size_t loop)>& output,
                  const std::function<void(const std::string& loop)>& in_force);
  // Whether every cycle has checked its offer.
  bool all_judged() const noexcept;
  // Marks unchecked offers in the plan as waiting for the next cycle.
  void hold_unjudged(reload::Plan& plan) const;

 private:
  struct Offer {
    std::size_t loop = 0;       // index among the running loops
    std::size_t plan_loop = 0;  // index in the plan
    std::uint32_t number = 0;
    bool judged = false;          // the cycle has checked it
    bool taken = false;           // the cycle has taken it
    bool out_of_service = false;  // it waits because the loop is being commissioned
    config::LoopConfig wanted;
  };
  struct Withdrawn {
    std::size_t loop = 0;      // index among the running loops
    std::uint32_t number = 0;  // number of the offer
    std::uint32_t after = 0;   // number of the withdrawal or of the replacing offer
    control::PidGains gains;
  };
  // Returns why a loop's settings wait.
  std::string why_held(const Offer& offer, const reload::Output& output) const;
  bool withdrawn_taken();
  // Returns false for a loop without changes. Such a loop gets no offer and keeps the commanded
  // mode of its jacket.
  static bool offered(const reload::LoopPlan& plan) noexcept;

  const std::vector<LoopRuntime>& loops_;
  std::vector<Offer> offers_;          // offers that are not in force yet
  std::vector<Withdrawn> withdrawn_;   // offers that the cycle may still have taken
  std::vector<std::uint32_t> newest_;  // number of the newest offer per loop
};

}  // namespace loopwarden::daemon
