// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "services/notify/app/commands.hpp"
#include "services/notify/app/notifier.hpp"
#include "services/notify/text/event_text.hpp"
#include "base/exit_code.hpp"

namespace loopwarden::notify {
namespace {

Sender sender_of(const NotifyConfig& config) { return {config.box, config.zone, config.page_url}; }

nlohmann::json to_json(const MessageRow& row, const Sender& sender) {
  nlohmann::json events = nlohmann::json::array();
  for (const Event& event : row.message.events) events.push_back(notify::to_json(event));
  return {{"id", row.message.id},
          {"channel", row.message.channel},
          {"made_ms", row.message.made_ms},
          {"text", headline(row.message, sender)},
          {"count", row.message.count()},
          {"lost", row.message.lost},
          {"events", std::move(events)},
          {"state", to_text(row.state)},
          {"attempts", row.message.attempts},
          {"at_ms", row.at_ms},
          {"perhaps_twice", row.message.perhaps_twice},
          {"result", row.result}};
}

void print(const MessageRow& row, const NotifyConfig& config) {
  fmt::print("{:>6}  {}  {:<12} {:<7} {}\n", row.message.id,
             local_time(row.message.made_ms, *config.zone), row.message.channel, to_text(row.state),
             headline(row.message, sender_of(config)));
  if (row.result.empty()) return;
  fmt::print("        {}, attempt {}: {}\n", local_time(row.at_ms, *config.zone),
             row.message.attempts, row.result);
}

}  // namespace

int list_notifications(const NotifyConfig& config, std::size_t most, bool json) {
  try {
    Outbox outbox(outbox_file(config.state_directory), sqlite::Access::read);
    for (const MessageRow& row : outbox.newest(most)) {
      json ? fmt::print("{}\n", dump(to_json(row, sender_of(config)))) : print(row, config);
    }
    return kExitOk;
  } catch (const sqlite::Error& e) {
    fmt::print(stderr, "loopwarden-notify: {}\n", e.what());
    return e.other_version() ? kExitConfiguration : kExitIo;
  }
}

}  // namespace loopwarden::notify
