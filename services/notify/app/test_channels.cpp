// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <future>
#include <span>
#include <utility>
#include <vector>

#include "base/clock.hpp"
#include "config/diagnostic.hpp"
#include "services/notify/app/commands.hpp"
#include "services/notify/channels/channel.hpp"
#include "services/notify/rules/dispatch.hpp"
#include "base/exit_code.hpp"

namespace loopwarden::notify {
namespace {

Message test_message(const std::string& channel) {
  const Event event{.utc_ms = base::utc_ms(),
                    .loop = "TEST",
                    .alarm = "test",
                    .state = "normal",
                    .severity_percent = std::nullopt,
                    .worst_percent = std::nullopt,
                    .reason = "test message, no alarm was raised"};
  Message message = message_of(channel, std::span(&event, 1), event.utc_ms);
  message.test = true;
  return message;
}

Delivery try_channel(const ChannelSettings& settings, const Sender& sender) {
  const std::atomic<bool> quit{false};
  try {
    return open_channel(settings, sender)->send(test_message(settings.name), quit);
  } catch (const std::exception& e) {
    return later(e.what());
  }
}

const char* word(Delivery::Outcome outcome) {
  switch (outcome) {
    case Delivery::Outcome::sent: return "sent";
    case Delivery::Outcome::sent_to_some: return "not sent to all";
    case Delivery::Outcome::later: return "failed";
    case Delivery::Outcome::refused:
    case Delivery::Outcome::shut_out: break;
  }
  return "refused";
}

}  // namespace

int test_channels(const NotifyConfig& config, const std::string& only) {
  std::vector<std::string> names;
  for (const ChannelSettings& channel : config.channels) names.push_back(channel.name);
  if (!only.empty() && std::find(names.begin(), names.end(), only) == names.end()) {
    fmt::print(stderr, "loopwarden-notify: no channel '{}'{}\n", config::quotable(only),
               config::suggestion(only, names));
    return kExitUsage;
  }
  const Sender sender{config.box, config.zone, config.page_url};
  std::vector<std::pair<std::string, std::future<Delivery>>> tries;
  for (const ChannelSettings& channel : config.channels) {
    if (!only.empty() && channel.name != only) continue;
    tries.emplace_back(channel.name, std::async(std::launch::async, try_channel, std::cref(channel),
                                                std::cref(sender)));
  }
  int exit_code = kExitOk;
  for (auto& [name, attempt] : tries) {
    const Delivery delivery = attempt.get();
    fmt::print("{}: {}: {}\n", name, word(delivery.outcome), delivery.text);
    if (delivery.outcome != Delivery::Outcome::sent) exit_code = kExitIo;
  }
  return exit_code;
}

}  // namespace loopwarden::notify
