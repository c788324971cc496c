// SPDX-License-Identifier: Apache-2.0
#include "services/notify/channels/channel.hpp"
#include "services/notify/channels/email_channel.hpp"
#include "services/notify/channels/journal_channel.hpp"
#include "services/notify/channels/syslog_channel.hpp"
#include "services/notify/channels/webhook_channel.hpp"

namespace loopwarden::notify {
namespace {

// Opens a channel, with one function per kind of settings.
struct Opener {
  const Sender& sender;

  std::unique_ptr<Channel> operator()(const JournalSettings& settings) const {
    static_cast<void>(settings);
    return std::make_unique<JournalChannel>(sender);
  }
  std::unique_ptr<Channel> operator()(const SyslogSettings& settings) const {
    return std::make_unique<SyslogChannel>(settings, sender);
  }
  std::unique_ptr<Channel> operator()(const EmailSettings& settings) const {
    if (settings.sendmail.empty()) return std::make_unique<SmtpChannel>(settings, sender);
    return std::make_unique<SendmailChannel>(settings, sender);
  }
  std::unique_ptr<Channel> operator()(const WebhookSettings& settings) const {
    return std::make_unique<WebhookChannel>(settings, sender);
  }
};

}  // namespace

std::unique_ptr<Channel> open_channel(const ChannelSettings& settings, const Sender& sender) {
  return std::visit(Opener{sender}, settings.kind);
}

}  // namespace loopwarden::notify
