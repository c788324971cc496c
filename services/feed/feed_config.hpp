// SPDX-License-Identifier: Apache-2.0
// feed.yaml, the configuration of loopwarden-feed.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "config/diagnostic.hpp"
#include "config/key_reference.hpp"
#include "services/net/mqtt/client.hpp"
#include "services/feed/values/foreign_edges.hpp"
#include "services/feed/values/topics.hpp"

namespace loopwarden::feed {

struct FeedConfig {
  mqtt::ClientSettings mqtt;
  std::filesystem::path runtime_directory = "/run/loopwardend";  // of the daemon: feed.sock
  std::chrono::milliseconds alive_interval{1000};
  std::string feeder;  // name in loopwardend.yaml; empty: its user identifies it
  std::vector<TopicRule> topics;
  std::vector<MetricRule> metrics;
  bool ask_rebirth = false;
  std::string log_level = "info";
};

// Whether the file must name values. Browsing works without them.
enum class Values { needed, not_needed };
config::Loaded<FeedConfig> read_feed_file(const std::filesystem::path& path,
                                          Values values = Values::needed);
// `file`: name in diagnostics, and start of relative paths.
config::Loaded<FeedConfig> read_feed_text(const std::string& file, std::string_view text,
                                          Values values = Values::needed);

config::KeyReference describe_feed();

}  // namespace loopwarden::feed
