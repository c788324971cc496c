// SPDX-License-Identifier: Apache-2.0
// The systemd journal, with each part of an event as a field of its own:
//   journalctl -t loopwarden-notify LOOPWARDEN_LOOP=FIC-101
#pragma once

#include <string>
#include <vector>

#include "services/notify/channels/channel.hpp"

namespace loopwarden::notify {

// NAME=value of each field.
std::vector<std::string> journal_fields(const Event& event, const Message& message,
                                        const Sender& sender);

class JournalChannel final : public Channel {
 public:
  explicit JournalChannel(Sender sender) : sender_(std::move(sender)) {}
  Delivery send(const Message& message, const std::atomic<bool>& quit) override;

 private:
  Sender sender_;
};

}  // namespace loopwarden::notify
