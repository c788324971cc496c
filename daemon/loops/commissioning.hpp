// SPDX-License-Identifier: Apache-2.0
// Who commissions a loop: it is out of service for everybody else until he gives it back, or shows no sign of life for a
// minute and the stop action is taken. Any thread.
//
// The holder is the one truth for ordinary threads. The cycle gets a copy in its channels, which is
// written with the holder under the same lock.
#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "config/loop_config.hpp"
#include "daemon/rt/control_cycle.hpp"

namespace loopwarden::daemon {

class Commissioning {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::duration<double> kSilence{60.0};

  // `channels`: of the loop; they outlive this.
  explicit Commissioning(rt::LoopChannels& channels) noexcept : channels_(channels) {}

  // Takes the loop, or with its session shows a sign of life. Returns the session. Throws RequestError where another has
  // it, or the session has ended. `utc_ms`: of the beginning.
  std::uint64_t take(const std::optional<std::uint64_t>& session, const std::string& peer,
                     std::int64_t utc_ms, Clock::time_point now);
  // False: nobody had it.
  bool give_back();
  // Throws RequestError where an order of who has this session, or none, must not move the loop. A sign of life.
  void check_command(const std::optional<std::uint64_t>& session, Clock::time_point now);
  // Whether who had it has been silent for too long: his session has ended, and the loop is out of service until it is
  // given back.
  bool silent(Clock::time_point now);

  // The one that has the loop; nullopt: nobody has it, or he has been silent for too long.
  std::optional<std::uint64_t> session() const;

  struct Holder {
    std::string by;
    std::int64_t since_ms;  // UTC
    double ends_in_s;       // without a sign of life; 0: it has been silent for too long
  };
  std::optional<Holder> holder(Clock::time_point now = Clock::now()) const;

  // Why a loop's commands can't be withheld for so long; null: they can.
  static const char* no_withholding(const config::LoopConfig& loop, double seconds, bool manual);

 private:
  struct Held {
    std::uint64_t session;
    std::string peer;
    std::int64_t since_ms;  // UTC
    Clock::time_point alive;
    bool silent;
  };
  // With the mutex.
  void show_life(std::uint64_t session, Clock::time_point now);
  void publish() noexcept;

  rt::LoopChannels& channels_;
  mutable std::mutex mutex_;
  std::optional<Held> held_;
  // Sessions of a daemon before this one are no sessions.
  std::uint64_t newest_ = static_cast<std::uint64_t>(
      std::chrono::system_clock::now().time_since_epoch() / std::chrono::milliseconds(1));
};

}  // namespace loopwarden::daemon
