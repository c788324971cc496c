// SPDX-License-Identifier: Apache-2.0
// E-mail: by SMTP with TLS, or through the `sendmail -t` of a local MTA.
#pragma once

#include <string>

#include "services/notify/channels/channel.hpp"

namespace loopwarden::notify {

// Sent: the server has taken it for at least one recipient; those it refused stand in the text. A recipient's own server
// may still bounce it.
class SmtpChannel final : public Channel {
 public:
  SmtpChannel(EmailSettings settings, Sender sender);
  Delivery send(const Message& message, const std::atomic<bool>& quit) override;

 private:
  EmailSettings settings_;
  Sender sender_;
  std::string password_;
};

// Sent: the program has taken it into its queue.
class SendmailChannel final : public Channel {
 public:
  SendmailChannel(EmailSettings settings, Sender sender);
  Delivery send(const Message& message, const std::atomic<bool>& quit) override;

 private:
  EmailSettings settings_;
  Sender sender_;
};

}  // namespace loopwarden::notify
