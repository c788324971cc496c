// SPDX-License-Identifier: Apache-2.0
#include "daemon/loops/commissioning.hpp"

#include <algorithm>

#include "daemon/protocol/requests.hpp"

namespace loopwarden::daemon {

void Commissioning::show_life(std::uint64_t session, Clock::time_point now) {
  if (session == closed_) throw protocol::RequestError("the test has ended: " + why_closed_);
  if (!held_ || held_->silent || held_->session != session) {
    throw protocol::RequestError(
        "the commissioning has ended: the loop was released, or the session was silent for too "
        "long");
  }
  held_->alive = now;
}

std::uint64_t Commissioning::take(const std::optional<std::uint64_t>& session,
                                  const std::string& peer, std::int64_t utc_ms,
                                  Clock::time_point now, Purpose purpose) {
  const std::lock_guard lock(mutex_);
  if (session) {
    show_life(*session, now);
  } else if (held_) {
    throw protocol::RequestError("the loop is in maintenance by " + held_->peer);
  } else {
    held_ = Held{.session = ++newest_,
                 .peer = peer,
                 .since_ms = utc_ms,
                 .alive = now,
                 .silent = false,
                 .purpose = purpose};
    publish();
  }
  return held_->session;
}

void Commissioning::publish() noexcept {
  channels_.withheld_until_ns.store(0, std::memory_order_relaxed);
  channels_.commissioned.store(held_.has_value(), std::memory_order_release);
}

void Commissioning::close(std::uint64_t session, const std::string& why) {
  const std::lock_guard lock(mutex_);
  closed_ = session;
  why_closed_ = why;
  if (held_ && held_->session == session) held_->silent = true;
}

bool Commissioning::held_by(std::uint64_t session) const {
  const std::lock_guard lock(mutex_);
  return held_ && held_->session == session;
}

bool Commissioning::give_back() {
  const std::lock_guard lock(mutex_);
  const bool was = held_.has_value();
  held_.reset();
  publish();
  return was;
}

void Commissioning::check_command(const std::optional<std::uint64_t>& session,
                                  Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (session) {
    show_life(*session, now);
    if (held_->purpose == Purpose::test) {
      throw protocol::RequestError("a test moves its loop by `commissioning` with `move`");
    }
  } else if (held_) {
    throw protocol::RequestError("the loop is out of service: " + held_->peer + " commissions it");
  }
}

bool Commissioning::silent(Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (held_ && now - held_->alive > kSilence) held_->silent = true;
  return held_ && held_->silent;
}

std::optional<std::uint64_t> Commissioning::session() const {
  const std::lock_guard lock(mutex_);
  if (!held_ || held_->silent) return std::nullopt;
  return held_->session;
}

std::optional<Commissioning::Holder> Commissioning::holder(Clock::time_point now) const {
  const std::lock_guard lock(mutex_);
  if (!held_) return std::nullopt;
  const double left_s = std::chrono::duration<double>(kSilence - (now - held_->alive)).count();
  return Holder{.by = held_->peer,
                .since_ms = held_->since_ms,
                .ends_in_s = held_->silent ? 0.0 : std::max(0.0, left_s),
                .purpose = held_->purpose};
}

const char* Commissioning::no_withholding(const config::LoopConfig& loop, double seconds,
                                          bool manual) {
  constexpr double kLongest_s = 300.0;
  if (!(seconds > 0.0 && seconds <= kLongest_s)) return "withhold_s is 0 to 300 s";
  const auto* modbus = std::get_if<hal::modbus::LoopModbusSettings>(&loop.io);
  if (modbus == nullptr) return "it has no device watchdog";
  if (modbus->comm_loss.protection == hal::modbus::CommLossProtection::none_accepted) {
    return "its file accepts that the valve keeps its position when commands cease (none_accepted)";
  }
  return manual ? nullptr : "commands are withheld in manual only";
}

}  // namespace loopwarden::daemon
