// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/commissioning.hpp"

#include "protocol/requests.hpp"

namespace loopwarden::daemon::console {

std::uint64_t CommissionedLoops::take(std::size_t loop, const std::optional<std::uint64_t>& session,
                                      const std::string& peer, Clock::time_point now) {
  const auto found = held_.find(loop);
  if (session) {
    if (found == held_.end() || found->second.session != *session) {
      throw protocol::RequestError("the commissioning has ended: it was given back, or silent");
    }
    found->second.alive = now;
    return *session;
  }
  if (found != held_.end()) {
    throw protocol::RequestError("the loop is being commissioned by " + found->second.peer);
  }
  held_[loop] = {.session = ++newest_, .peer = peer, .alive = now};
  return newest_;
}

void CommissionedLoops::check_order(std::size_t loop, const std::optional<std::uint64_t>& session,
                                    Clock::time_point now) {
  if (session) {
    take(loop, session, {}, now);
  } else if (const auto found = held_.find(loop); found != held_.end()) {
    throw protocol::RequestError("the loop is out of service: " + found->second.peer +
                                 " commissions it");
  }
}

std::vector<std::size_t> CommissionedLoops::take_silent(Clock::time_point now) {
  std::vector<std::size_t> silent;
  for (const auto& [loop, held] : held_) {
    if (now - held.alive > kSilence) silent.push_back(loop);
  }
  for (const std::size_t loop : silent) held_.erase(loop);
  return silent;
}

const char* CommissionedLoops::no_withholding(const config::LoopConfig& loop, double seconds,
                                              bool manual) {
  constexpr double kLongest_s = 300.0;
  if (!(seconds > 0.0 && seconds <= kLongest_s)) return "withhold_s is 0 to 300 s";
  const auto* modbus = std::get_if<hal::modbus::LoopModbusSettings>(&loop.io);
  if (modbus == nullptr) return "no device's watchdog stands behind it";
  if (modbus->comm_loss.protection == hal::modbus::CommLossProtection::none_accepted) {
    return "its file says that nothing moves the valve when commands cease (none_accepted)";
  }
  return manual ? nullptr : "commands are withheld in manual alone";
}

}  // namespace loopwarden::daemon::console
