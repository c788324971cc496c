// SPDX-License-Identifier: Apache-2.0
#include "services/notify/config/notify_config.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "config/document.hpp"
#include "model/alarm/box_alarms.hpp"
#include "services/notify/config/channel_reader.hpp"
#include "services/notify/config/route_reader.hpp"
#include "services/notify/rules/routing.hpp"
#include "services/notify/text/one_line.hpp"

namespace loopwarden::notify {
namespace {

using config::MapReader;
using config::Value;

constexpr std::size_t kMostChannels = 32;  // each has a thread

std::string host_name() {
  std::array<char, 256> name{};
  gethostname(name.data(), name.size() - 1);
  return one_line(name.data());
}

bool is_name(const std::string& name) {
  return !name.empty() && name.size() <= 40 &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                  c == '-' || c == '_';
         });
}

void read_channels(MapReader& in, const std::string& file, NotifyConfig& notify) {
  for (auto& [name, section] : in.maybe_named_sections("channels", "name", "ways out of the box")) {
    if (!section.describing() && !is_name(name)) {
      section.error("a channel's name has 1 to 40 letters, digits, - or _");
    }
    ReadChannel channel = read_channel(section, name, file);
    notify.channels.push_back(std::move(channel.settings));
    notify.rules.channels.push_back(std::move(channel.rule));
  }
  const std::size_t count = notify.channels.size();
  if (!in.describing() && (count == 0 || count > kMostChannels)) {
    in.error("channels", fmt::format("must be 1 to {} channels", kMostChannels));
  }
}

std::string read_page_url(MapReader& in) {
  std::string url =
      in.text("page_url",
              "address of the box's page, https://HOST[:PORT], for links; no links if not given",
              "")
          .value;
  if (url.empty()) return url;
  const bool plain = std::all_of(url.begin(), url.end(), [](char c) {
    return c > ' ' && c <= '~' && c != '"' && c != '<' && c != '>';
  });
  if (!plain || !(url.starts_with("https://") || url.starts_with("http://"))) {
    in.error("page_url", "must be https://HOST[:PORT] or http://HOST[:PORT]");
  }
  while (url.ends_with('/')) url.pop_back();
  return url;
}

std::vector<std::string> names_of(const NotifyConfig& notify) {
  std::vector<std::string> names;
  for (const ChannelRule& channel : notify.rules.channels) names.push_back(channel.name);
  return names;
}

// Warns about a channel that no route uses: it is probably a mistake.
void report_unused(MapReader& in, const RuleSettings& rules) {
  for (const ChannelRule& channel : rules.channels) {
    const auto has = [&](const std::vector<std::string>& names) {
      return std::find(names.begin(), names.end(), channel.name) != names.end();
    };
    const bool used = std::any_of(rules.routes.begin(), rules.routes.end(), [&](const Route& r) {
      return has(r.channels) || std::any_of(r.reminders.begin(), r.reminders.end(),
                                            [&](const Escalation& s) { return has(s.channels); });
    });
    if (!used) in.warning("channels", fmt::format("no route goes to '{}'", channel.name));
  }
}

bool is_for_logs_alone(const Route& route, const std::vector<ChannelRule>& channels) {
  const auto all_logs = [&](const std::vector<std::string>& names) {
    return std::all_of(names.begin(), names.end(), [&](const std::string& name) {
      return std::any_of(channels.begin(), channels.end(), [&](const ChannelRule& channel) {
        return channel.name == name && channel.one_each;
      });
    });
  };
  return all_logs(route.channels) &&
         std::all_of(route.reminders.begin(), route.reminders.end(),
                     [&](const Escalation& step) { return all_logs(step.channels); });
}

// Warns about alarms of the box without a route. They belong to no loop and are easily forgotten.
void report_box_alarms(MapReader& in, const RuleSettings& rules) {
  std::vector<std::string> by_all, by_none;
  for (const alarm::BoxAlarm kind : alarm::kBoxAlarms) {
    const BoxWay way = box_way(rules.routes, to_text(kind));
    if (way == BoxWay::all) by_all.emplace_back(to_text(kind));
    if (way == BoxWay::none) by_none.emplace_back(to_text(kind));
  }
  if (!by_all.empty()) {
    in.warning("routes", fmt::format("no route to people has the box's {}: all routes report them. "
                                     "Name box in the `loops` of one",
                                     fmt::join(by_all, ", ")));
  }
  if (!by_none.empty()) {
    in.warning("routes", fmt::format("no route has the box's {}: no channel reports them",
                                     fmt::join(by_none, ", ")));
  }
}

void read_rules(MapReader& in, NotifyConfig& notify) {
  const std::vector<std::string> names = names_of(notify);
  RuleSettings& rules = notify.rules;
  rules.daemon_down_after_ms =
      std::llround(1000.0 * in.number("daemon_down_after",
                                      {"s", config::between(5.0, 3600.0),
                                       "silence of the daemon that raises the alarm `daemon`"},
                                      15.0));
  for (MapReader& route : in.maybe_list(
           "routes", "which channels get which alarms; every route that matches applies")) {
    rules.routes.push_back(read_route(route, names));
    rules.routes.back().logs_only = is_for_logs_alone(rules.routes.back(), rules.channels);
  }
  for (MapReader& hours :
       in.maybe_list("quiet_hours", "hours during which events wait until their end")) {
    rules.quiet_hours.push_back(read_quiet_hours(hours, names));
  }
  if (in.describing()) return;
  if (rules.routes.empty())
    in.error("routes", "must hold at least one route; otherwise no alarm is sent");
  report_unused(in, rules);
  if (!rules.routes.empty()) report_box_alarms(in, rules);
}

NotifyConfig read_notify(MapReader& in, const std::string& file) {
  NotifyConfig notify;
  notify.box =
      one_line(in.text("box", "name of this box in messages; host name where not given", "").value);
  if (notify.box.empty()) notify.box = host_name();
  notify.socket = in.text("socket", "the daemon's status socket", "/run/loopwardend/status.sock");
  notify.state_directory =
      in.text("state_directory", "holds the queue and the journal", "/var/lib/loopwarden-notify");
  notify.log_level =
      in.word_of("log_level", {"info", "debug", "warn", "error"}, "least level that is logged");
  const Value<std::string> zone = in.text("time_zone", "of times in texts for people", "UTC");
  notify.zone = read_zone(in, "time_zone", zone);
  notify.page_url = read_page_url(in);
  read_channels(in, file, notify);
  for (ChannelRule& channel : notify.rules.channels) channel.zone = notify.zone;
  read_rules(in, notify);
  return notify;
}

}  // namespace

config::Loaded<NotifyConfig> read_notify_text(const std::string& file, std::string_view text) {
  return config::load_text<NotifyConfig>(file, text,
                                         [&](MapReader& in) { return read_notify(in, file); });
}

config::Loaded<NotifyConfig> read_notify_file(const std::filesystem::path& path) {
  return config::load_file(path, read_notify_text);
}

config::KeyReference describe_notify() {
  return config::keys_of([](MapReader& in) { read_notify(in, ""); });
}

}  // namespace loopwarden::notify
