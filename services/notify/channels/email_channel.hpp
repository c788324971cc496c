// SPDX-License-Identifier: Apache-2.0
// E-mail: by SMTP with TLS, or through the `sendmail -t` of a local MTA.
#pragma once

#include <string>

#include "services/notify/channels/channel.hpp"

namespace loopwarden::notify {

// Sent: the server has taken the message for at least one recipient. The text lists the recipients
// that it refused. A recipient's own server may still bounce the message.
class SmtpChannel final : public Channel {
 public:
  SmtpChannel(EmailSettings settings, Sender sender);
  Delivery send(const Message& message, const std::atomic<bool>& quit) override;

 private:
  EmailSettings settings_;
  Sender sender_;
  std::string password_;
};

// Sent: the program has put the message into its queue.
class SendmailChannel final : public Channel {
 public:
  SendmailChannel(EmailSettings settings, Sender sender);
  Delivery send(const Message& message, const std::atomic<bool>& quit) override;

 private:
  EmailSettings settings_;
  Sender sender_;
};

}  // namespace loopwarden::notify
