// SPDX-License-Identifier: Apache-2.0
#include "services/notify/channels/journal_channel.hpp"

#include <fmt/format.h>
#include <sys/uio.h>
// Leaves out the position in this source: the fields below describe the event.
#define SD_JOURNAL_SUPPRESS_LOCATION
#include <systemd/sd-journal.h>
#include <unistd.h>

#include <array>
#include <cstring>

namespace loopwarden::notify {
namespace {

constexpr const char* kSocket = "/run/systemd/journal/socket";

// Message ids for `journalctl MESSAGE_ID=`, one per Change, made with `journalctl --new-id128`.
constexpr std::array kMessageIds{
    "85484973c60c49e8b84e24317688ea48", "8c651e71174f462080ea613eaf379b12",
    "444cd89ecf4745549948ff65683eb692", "40440f289401421487e03ebc23913e86",
    "30acbe4bfda243469f1a7620c1465960"};

std::string percent(const std::optional<double>& value) {
  return value ? fmt::format("{:.3f}", *value) : std::string();
}

}  // namespace

std::vector<std::string> journal_fields(const Event& event, const Message& message,
                                        const Sender& sender) {
  std::vector<std::string> fields;
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) fields.push_back(fmt::format("{}={}", name, value));
  };
  add("MESSAGE", message.test ? headline(message, sender) : sentence(event, sender));
  add("MESSAGE_ID", kMessageIds.at(static_cast<std::size_t>(event.change)));
  add("PRIORITY", fmt::format("{}", message.test ? 6 : priority_of(event)));
  add("SYSLOG_IDENTIFIER", "loopwarden-notify");
  add("LOOPWARDEN_BOX", sender.box);
  add("LOOPWARDEN_NOTIFICATION", fmt::format("{}", message.id));
  add("LOOPWARDEN_LOOP", event.loop);
  add("LOOPWARDEN_ALARM", event.alarm);
  add("LOOPWARDEN_CHANGE", to_text(event.change));
  add("LOOPWARDEN_STATE", event.state);
  add("LOOPWARDEN_SEVERITY_PERCENT", percent(event.severity_percent));
  add("LOOPWARDEN_PEER", event.peer);
  add("LOOPWARDEN_REASON", event.reason);
  if (message.lost > 0) add("LOOPWARDEN_LOST", fmt::format("{}", message.lost));
  add("LOOPWARDEN_TIME", rfc3339(event.utc_ms));
  return fields;
}

Delivery JournalChannel::send(const Message& message, const std::atomic<bool>& quit) {
  static_cast<void>(quit);  // it never waits
  // Without a journal, the call below reports success and loses the entry.
  if (access(kSocket, W_OK) != 0) {
    return later(fmt::format("no journal at {}: {}", kSocket, std::strerror(errno)));
  }
  for (const Event& event : message.events) {
    const std::vector<std::string> fields = journal_fields(event, message, sender_);
    std::vector<iovec> parts;
    for (const std::string& field : fields) {
      parts.push_back({const_cast<char*>(field.data()), field.size()});
    }
    const int result = sd_journal_sendv(parts.data(), static_cast<int>(parts.size()));
    if (result < 0) return later(fmt::format("journal: {}", std::strerror(-result)));
  }
  return sent("taken by the journal");
}

}  // namespace loopwarden::notify
