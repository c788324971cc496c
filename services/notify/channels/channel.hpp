// SPDX-License-Identifier: Apache-2.0
// A way to send messages from the box. Each channel has its own thread, so a dead channel delays no
// other. Each call ends within the channel's time-outs.
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

// The result of one attempt.
struct Delivery {
  enum class Outcome : std::uint8_t {
    sent,
    sent_to_some,  // the other recipients are refused, and always will be
    later,         // the fault may pass: try again
    refused,       // this message will never be taken
    shut_out       // no message will be taken: the channel's user or password is refused
  };
  Outcome outcome = Outcome::sent;
  std::string text;                       // one line
  std::optional<std::int64_t> wait_ms{};  // as requested by the other side

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

  // Ends early with `later` if `quit` becomes true. Throws only if memory runs out.
  virtual Delivery send(const Message& message, const std::atomic<bool>& quit) = 0;
};

// Opens a channel and reads its secrets. Throws std::runtime_error if a secret can't be read.
std::unique_ptr<Channel> open_channel(const ChannelSettings& settings, const Sender& sender);

}  // namespace loopwarden::notify
