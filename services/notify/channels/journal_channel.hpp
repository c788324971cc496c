// SPDX-License-Identifier: Apache-2.0
// Writes to the systemd journal, with a separate field for each part of an event:
//   journalctl -t loopwarden-notify LOOPWARDEN_LOOP=FIC-101
#pragma once

#include <string>
#include <vector>

#include "services/notify/channels/channel.hpp"

namespace loopwarden::notify {

// Returns NAME=value of each field.
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
