// SPDX-License-Identifier: Apache-2.0
// Settings on their way from a plan to the loops' cycles. Used by the main thread.
//
// A cycle may take an offer while a newer plan, made without it, withdraws it. Every withdrawn
// offer is followed until the cycle has either taken it or seen that it is withdrawn, so that no
// taken offer is lost from view.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "config/loop_config.hpp"
#include "daemon/app/reload.hpp"
#include "daemon/loops/loop_runtime.hpp"

namespace loopwarden::daemon {

class SettingsOffers {
 public:
  // `loops` may come later, before make(); there are `count` of them.
  SettingsOffers(const std::vector<LoopRuntime>& loops, std::size_t count)
      : loops_(loops), newest_(count, 0) {}

  // Offers each loop what the plan applies of it. What an earlier plan has left waiting is replaced, or withdrawn.
  void make(const reload::Plan& plan, const config::Configuration& wanted);
  struct Followed {
    bool changed = false;      // the plan is another than before
    bool taken_after = false;  // a withdrawn offer is in force: the plan was made without it
  };
  // Puts what the cycles have made of it so far into the plan it was made from.
  // `in_force`: called for a loop whose settings had waited for its output.
  Followed follow(reload::Plan& plan, const std::function<reload::Output(std::size_t loop)>& output,
                  const std::function<void(const std::string& loop)>& in_force);
  // Every cycle has looked at what it was offered.
  bool all_judged() const noexcept;
  // Into the plan: those that have not looked yet wait for their next cycle.
  void hold_unjudged(reload::Plan& plan) const;

 private:
  struct Offer {
    std::size_t loop = 0;       // of those that run
    std::size_t plan_loop = 0;  // of the plan
    std::uint32_t number = 0;
    bool judged = false;          // the cycle has looked at it
    bool taken = false;           // and taken it
    bool out_of_service = false;  // it waits because somebody commissions the loop
    config::LoopConfig wanted;
  };
  struct Withdrawn {
    std::size_t loop = 0;      // of those that run
    std::uint32_t number = 0;  // of the offer
    std::uint32_t after = 0;   // of what withdrew or replaced it
    control::PidGains gains;
  };
  // Why a loop's settings wait.
  std::string why_held(const Offer& offer, const reload::Output& output) const;
  bool withdrawn_taken();
  // False for a loop of which nothing changes: it is left as it is, with what was ordered of its jacket.
  static bool offered(const reload::LoopPlan& plan) noexcept;

  const std::vector<LoopRuntime>& loops_;
  std::vector<Offer> offers_;          // those that are not in force yet
  std::vector<Withdrawn> withdrawn_;   // those that the cycle may still have taken
  std::vector<std::uint32_t> newest_;  // number of the newest offer to each loop
};

}  // namespace loopwarden::daemon
