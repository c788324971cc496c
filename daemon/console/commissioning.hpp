// SPDX-License-Identifier: Apache-2.0
// Loops that somebody commissions: each is out of service for everybody else until he gives it back, or shows no sign of
// life for a minute. Used by lw-control alone.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "config/loop_config.hpp"

namespace loopwarden::daemon::console {

class CommissionedLoops {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::duration<double> kSilence{60.0};

  // Takes the loop, or with its session shows a sign of life. Returns the session. Throws RequestError where another has
  // it, or the session has ended.
  std::uint64_t take(std::size_t loop, const std::optional<std::uint64_t>& session,
                     const std::string& peer, Clock::time_point now);
  // False: nobody had it.
  bool give_back(std::size_t loop) { return held_.erase(loop) > 0; }
  // Throws RequestError where an order of who has this session, or none, must not move the loop. A sign of life.
  void check_order(std::size_t loop, const std::optional<std::uint64_t>& session,
                   Clock::time_point now);
  // Those that have been silent for too long, which are nobody's from now on.
  std::vector<std::size_t> take_silent(Clock::time_point now);

  // Why a loop's commands can't be withheld for so long; null: they can.
  static const char* no_withholding(const config::LoopConfig& loop, double seconds, bool manual);

 private:
  struct Held {
    std::uint64_t session;
    std::string peer;
    Clock::time_point alive;
  };
  std::map<std::size_t, Held> held_;
  // Sessions of a daemon before this one are no sessions.
  std::uint64_t newest_ = static_cast<std::uint64_t>(
      std::chrono::system_clock::now().time_since_epoch() / std::chrono::milliseconds(1));
};

}  // namespace loopwarden::daemon::console
