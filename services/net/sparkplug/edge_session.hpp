// SPDX-License-Identifier: Apache-2.0
// States of an edge node by the Sparkplug specification. The caller reports events and gets the
// required next step.
//
//   offline --connected--> waiting for the primary host, if there is one
//           --host online--> live: births, then data
//   live --host offline--> publishes its own death, leaves the broker and connects again
//   live --rebirth requested--> births again, with the same bdSeq, from seq 0
#pragma once

#include <cstdint>
#include <optional>

#include "services/net/sparkplug/host_state.hpp"
#include "services/net/sparkplug/sequence.hpp"

namespace loopwarden::sparkplug {

class EdgeSession {
 public:
  enum class State : std::uint8_t { offline, waiting_for_host, live };
  enum class Next : std::uint8_t {
    nothing,
    births,  // publish NBIRTH and every DBIRTH before any other message
    leave    // publish NDEATH, disconnect
  };

  // `last_bd_seq`: bdSeq of the last attempted connection, also by an earlier run of the program;
  // nullopt: none.
  EdgeSession(bool has_primary_host, std::optional<std::uint8_t> last_bd_seq);

  // Call it before each attempt to connect. Returns the bdSeq for the will. Store it on the disk
  // before connecting.
  std::uint8_t connecting() noexcept;
  Next connected() noexcept;
  void disconnected() noexcept;
  // State of the primary host.
  Next host_said(const HostState& state);
  Next rebirth_asked() const noexcept;

  State state() const noexcept { return state_; }
  bool live() const noexcept { return state_ == State::live; }
  bool host_online() const noexcept { return host_.online(); }
  // bdSeq of the newest attempted connection; 0 before the first one.
  std::uint8_t bd_seq() const noexcept { return bd_seq_.value_or(0); }
  // seq of the NBIRTH, which restarts the count; and seq of the next message.
  std::uint8_t birth_seq() noexcept { return seq_.restart(); }
  std::uint8_t next_seq() noexcept { return seq_.next(); }

 private:
  bool has_primary_host_;
  std::optional<std::uint8_t> bd_seq_;
  State state_ = State::offline;
  HostWatch host_;
  Sequence seq_;
};

}  // namespace loopwarden::sparkplug
