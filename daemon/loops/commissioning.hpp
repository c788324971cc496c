// SPDX-License-Identifier: Apache-2.0
// Grants one user a loop for commissioning. The loop is out of service for all others until the
// user releases it. If there is no sign of life for a minute, the session ends and the stop action
// is taken. Thread-safe.
//
// For ordinary threads the holder is authoritative. The loop's cycle gets a copy in its channels.
// Both are written under the same lock.
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

  // `channels`: those of the loop; they must outlive this.
  explicit Commissioning(rt::LoopChannels& channels) noexcept : channels_(channels) {}

  // work: the holder commands the loop. test: the daemon moves it, and restores it at the end.
  enum class Purpose : std::uint8_t { work, test };

  // Takes the loop, or shows a sign of life with the loop's session. Returns the session. Throws
  // RequestError if another session has the loop, or the session has ended. `utc_ms`: time of the
  // start.
  std::uint64_t take(const std::optional<std::uint64_t>& session, const std::string& peer,
                     std::int64_t utc_ms, Clock::time_point now, Purpose purpose = Purpose::work);
  // The session accepts no more requests, for this reason. The loop stays out of service until it
  // is released.
  void close(std::uint64_t session, const std::string& why);
  // Returns whether this session has the loop, open or closed.
  bool held_by(std::uint64_t session) const;
  // Releases the loop. Returns false if it was not taken.
  bool give_back();
  // Throws RequestError if a command with this session, or without one, must not move the loop.
  // Otherwise it counts as a sign of life.
  void check_command(const std::optional<std::uint64_t>& session, Clock::time_point now);
  // Returns whether the holder has been silent for too long. Its session has then ended, and the
  // loop stays out of service until it is released.
  bool silent(Clock::time_point now);

  // Returns the session that has the loop; nullopt if the loop is not taken, or its holder has been
  // silent for too long.
  std::optional<std::uint64_t> session() const;

  struct Holder {
    std::string by;
    std::int64_t since_ms;  // UTC
    double ends_in_s;       // without a sign of life; 0: the holder has been silent for too long
    Purpose purpose;
  };
  std::optional<Holder> holder(Clock::time_point now = Clock::now()) const;

  // Returns why a loop's commands can't be withheld for this time; null: they can.
  static const char* no_withholding(const config::LoopConfig& loop, double seconds, bool manual);

 private:
  struct Held {
    std::uint64_t session;
    std::string peer;
    std::int64_t since_ms;  // UTC
    Clock::time_point alive;
    bool silent;
    Purpose purpose;
  };
  // Call it with the mutex held.
  void show_life(std::uint64_t session, Clock::time_point now);
  void publish() noexcept;

  rt::LoopChannels& channels_;
  mutable std::mutex mutex_;
  std::optional<Held> held_;
  std::uint64_t closed_ = 0;  // newest session that was closed for a reason
  std::string why_closed_;
  // Starts at the present time, so that sessions of an earlier daemon are invalid.
  std::uint64_t newest_ = static_cast<std::uint64_t>(
      std::chrono::system_clock::now().time_since_epoch() / std::chrono::milliseconds(1));
};

}  // namespace loopwarden::daemon
