// SPDX-License-Identifier: Apache-2.0
// One way out of the box. Each channel has a thread of its own, so a dead one delays no other; each call ends within the
// channel's time-outs.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "services/notify/channels/channel_settings.hpp"
#include "services/notify/rules/message.hpp"
#include "services/notify/text/event_text.hpp"

namespace loopwarden::notify {

// What came of it.
struct Delivery {
  enum class Outcome : std::uint8_t {
    sent,
    sent_to_some,  // others of those that it is for are refused, and will be
    later,         // the fault may pass: try again
    refused,       // this message will never be taken
    shut_out       // nor will any other: the channel's own user or password is refused
  };
  Outcome outcome = Outcome::sent;
  std::string text;                       // one line
  std::optional<std::int64_t> wait_ms{};  // as the other side asks for it

  bool is_sent() const noexcept {
    return outcome == Outcome::sent || outcome == Outcome::sent_to_some;
  }
};

inline Delivery sent(std::string text) { return {Delivery::Outcome::sent, std::move(text), {}}; }
inline Delivery later(std::string text) { return {Delivery::Outcome::later, std::move(text), {}}; }
inline Delivery refused(std::string text) {
  return {Delivery::Outcome::refused, std::move(text), {}};
}

class Channel {
 public:
  Channel() = default;
  Channel(const Channel&) = delete;
  Channel& operator=(const Channel&) = delete;
  virtual ~Channel() = default;

  // Ends early with `later` where `quit` becomes true. Throws nothing but for lack of memory.
  virtual Delivery send(const Message& message, const std::atomic<bool>& quit) = 0;
};

// Reads the channel's secrets. Throws std::runtime_error if one can't be read.
std::unique_ptr<Channel> open_channel(const ChannelSettings& settings, const Sender& sender);

}  // namespace loopwarden::notify
