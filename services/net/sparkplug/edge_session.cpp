// SPDX-License-Identifier: Apache-2.0
#include "services/net/sparkplug/edge_session.hpp"

namespace loopwarden::sparkplug {

EdgeSession::EdgeSession(bool has_primary_host, std::optional<std::uint8_t> last_bd_seq)
    : has_primary_host_(has_primary_host), bd_seq_(last_bd_seq) {}

std::uint8_t EdgeSession::connecting() noexcept {
  bd_seq_ = bd_seq_ ? bd_seq_after(*bd_seq_) : std::uint8_t{0};
  state_ = State::offline;
  // The broker retains the host's last state and sends it again.
  host_.forget();
  return *bd_seq_;
}

EdgeSession::Next EdgeSession::connected() noexcept {
  // A broker may send retained messages before it grants the subscription.
  const bool go = !has_primary_host_ || host_.online();
  state_ = go ? State::live : State::waiting_for_host;
  return go ? Next::births : Next::nothing;
}

void EdgeSession::disconnected() noexcept { state_ = State::offline; }

EdgeSession::Next EdgeSession::host_said(const HostState& state) {
  if (!has_primary_host_ || !host_.hear(state)) return Next::nothing;
  if (host_.online() && state_ == State::waiting_for_host) {
    state_ = State::live;
    return Next::births;
  }
  if (!host_.online() && state_ == State::live) {
    state_ = State::offline;
    return Next::leave;
  }
  return Next::nothing;
}

EdgeSession::Next EdgeSession::rebirth_asked() const noexcept {
  return live() ? Next::births : Next::nothing;
}

}  // namespace loopwarden::sparkplug
