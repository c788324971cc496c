// SPDX-License-Identifier: Apache-2.0
// What an edge node may do when, by the specification: it is told what happens and answers what must follow.
//
//   offline --connected--> waiting for the primary host, if there is one --host online--> live: births, then data
//   live --host offline--> its own death, then it leaves the broker and connects anew
//   live --rebirth asked--> births again, with the same bdSeq, from seq 0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "services/net/sparkplug/host_state.hpp"
#include "services/net/sparkplug/sequence.hpp"

namespace loopwarden::sparkplug {

class EdgeSession {
 public:
  enum class State : std::uint8_t { offline, waiting_for_host, live };
  enum class Next : std::uint8_t {
    nothing,
    births,  // NBIRTH and every DBIRTH, before anything else
    leave    // publish NDEATH, disconnect
  };

  // `last_bd_seq`: of the last connection that was tried, also by an earlier run of the program; nullopt if none was.
  EdgeSession(bool has_primary_host, std::optional<std::uint8_t> last_bd_seq);

  // A connection is about to be tried; returns the bdSeq of its will, to be kept on the disk before.
  std::uint8_t connecting() noexcept;
  Next connected() noexcept;
  void disconnected() noexcept;
  // Of the primary host.
  Next host_said(const HostState& state);
  Next rebirth_asked() const noexcept;

  State state() const noexcept { return state_; }
  bool live() const noexcept { return state_ == State::live; }
  bool host_online() const noexcept { return host_.online(); }
  // Of the newest connection that was tried; 0 before the first.
  std::uint8_t bd_seq() const noexcept { return bd_seq_.value_or(0); }
  // seq of the NBIRTH, which begins the count; then of each message after it.
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
