// SPDX-License-Identifier: Apache-2.0
// Reads notify.yaml: the daemon that loopwarden-notify watches, its channels and its routes.
// docs/reference/notify-keys.md lists every key.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "config/diagnostic.hpp"
#include "config/key_reference.hpp"
#include "services/notify/channels/channel_settings.hpp"
#include "services/notify/rules/rule_settings.hpp"

namespace loopwarden::notify {

struct NotifyConfig {
  std::string box;
  std::string socket;
  std::string state_directory;
  std::string log_level;
  const date::time_zone* zone = nullptr;  // of times in texts
  std::string page_url;                   // without a slash at the end; empty: no page
  RuleSettings rules;
  std::vector<ChannelSettings> channels;  // in the order of rules.channels
};

config::Loaded<NotifyConfig> read_notify_file(const std::filesystem::path& path);
// `file`: name in diagnostics, and start of relative paths.
config::Loaded<NotifyConfig> read_notify_text(const std::string& file, std::string_view text);

config::KeyReference describe_notify();

}  // namespace loopwarden::notify
