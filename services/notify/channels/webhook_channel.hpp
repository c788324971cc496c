// SPDX-License-Identifier: Apache-2.0
// A POST of JSON to a URL. Headers: X-Loopwarden-Timestamp (Unix s), X-Loopwarden-Delivery (the same for each attempt of a
// message) and, with a key, X-Loopwarden-Signature: sha256= and the HMAC-SHA-256 over timestamp, a dot and the body. Who
// receives it checks the signature and refuses old timestamps, so that nobody can play it back.
//
// 2xx: sent. 4xx is final, but for 408, 425 and 429; whatever else is tried again. Redirections are not followed.
#pragma once

#include <string>

#include "services/notify/channels/channel.hpp"

namespace loopwarden::notify {

std::string webhook_body(const Message& message, const Sender& sender);
// The value of the header.
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
