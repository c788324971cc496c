// SPDX-License-Identifier: Apache-2.0
// Posts JSON to a URL. Headers: X-Loopwarden-Timestamp (Unix s), X-Loopwarden-Delivery (the same
// for each attempt of a message) and, with a key, X-Loopwarden-Signature: sha256= and the
// HMAC-SHA-256 over timestamp, a dot and the body. A receiver prevents replays if it checks the
// signature and refuses old timestamps.
//
// 2xx: sent. 4xx is final, except 408, 425 and 429. Every other result is tried again. Redirections
// are not followed.
#pragma once

#include <string>

#include "services/notify/channels/channel.hpp"

namespace loopwarden::notify {

std::string webhook_body(const Message& message, const Sender& sender);
// Returns the value of the header X-Loopwarden-Signature.
std::string webhook_signature(const std::string& key, std::int64_t unix_s, const std::string& body);

class WebhookChannel final : public Channel {
 public:
  WebhookChannel(WebhookSettings settings, Sender sender);
  Delivery send(const Message& message, const std::atomic<bool>& quit) override;

 private:
  WebhookSettings settings_;
  Sender sender_;
  std::string key_;
};

}  // namespace loopwarden::notify
