// SPDX-License-Identifier: Apache-2.0
#include <sys/statvfs.h>

#include "daemon/protocol/ask.hpp"
#include "daemon/protocol/setups.hpp"
#include "services/page/api/body.hpp"
#include "services/page/api/gate.hpp"
#include "services/page/api/handlers.hpp"

namespace loopwarden::page::api {
namespace {

using nlohmann::json;

json counters_json(const http::Counters& c) {
  return {
      {"connections", c.connections}, {"streams", c.streams},         {"accepted", c.accepted},
      {"displaced", c.displaced},     {"turned_away", c.turned_away}, {"timed_out", c.timed_out},
      {"refused", c.refused},         {"requests", c.requests},       {"bytes_sent", c.bytes_sent}};
}

json disk_json(const std::filesystem::path& folder) {
  struct statvfs status {};
  if (::statvfs(folder.c_str(), &status) != 0) return nullptr;
  const auto block = static_cast<std::uint64_t>(status.f_frsize);
  return {{"path", folder.string()},
          {"bytes", status.f_blocks * block},
          {"free_bytes", status.f_bavail * block}};
}

json state_json(const Box::Now& now) {
  return {{"up", now.up}, {"since_ms", now.since_ms}, {"why", now.why}};
}

// Returns the setups: an empty list if the daemon's version does not know them, null if a slow disk
// delays them. The rest of the page does not wait for them.
json setups_json(protocol::Daemon& daemon) {
  try {
    return daemon.ask(protocol::SetupsRequest{}).at("setups");
  } catch (const protocol::DaemonError& e) {
    return e.refused() ? json::array() : json();
  }
}

}  // namespace

http::Response describe(Context& context, const Call& call) {
  check_query(call.request, {});
  const Box::Now now = context.now();
  http::Response response;
  if (!now.state) {
    response.body = dump({{"up", false}, {"loops", json::array()}});
    return response;
  }
  // The daemon's text is an object; `up` is inserted at its front.
  response.body = (now.up ? R"({"up":true,)" : R"({"up":false,)") + now.state->text.substr(1);
  return response;
}

http::Response events(Context& context, const Call& call) {
  check_query(call.request, {});
  http::Response response;
  response.content_type = "text/event-stream";
  // Before the first event: the time after which a browser reconnects.
  response.body = "retry: 1000\n\n";
  response.may_stay = [&context, request = call.request] {
    return identity_of(context, request, Renews::never).role >= Role::viewer;
  };
  return response;
}

http::Response sparklines(Context& context, const Call& call) {
  check_query(call.request, {});
  http::Response response;
  response.body = context.sparklines();
  return response;
}

http::Response alarms(Context& context, const Call& call) {
  check_query(call.request, {});
  const Box::Now now = context.now();
  http::Response response;
  if (!now.alarms) {
    throw protocol::DaemonError(protocol::DaemonError::Kind::down,
                                now.why.empty() ? "the daemon was not asked yet" : now.why);
  }
  response.shared = now.alarms;
  return response;
}

http::Response alarm_figures(Context& context, const Call& call) {
  check_query(call.request, {"hours"});
  protocol::AlarmFiguresRequest wanted;
  if (const auto hours = whole_in(call.request, "hours", 1, 720)) {
    wanted.hours = static_cast<std::uint64_t>(*hours);
  }
  return json_response(context.daemon.ask(wanted));
}

http::Response system(Context& context, const Call& call) {
  check_query(call.request, {});
  const Box::Now now = context.now();
  json answer = {{"up", now.up},
                 {"daemon_state", state_json(now)},
                 {"daemon", nullptr},
                 {"page", counters_json(context.counters())},
                 {"disk", disk_json(context.settings.state_directory)}};
  answer["page"]["version"] = LOOPWARDEN_VERSION;
  answer["page"]["history_bytes"] = context.history.bytes();
  answer["page"]["sessions"] = context.sessions.size();
  if (!now.up) return json_response(answer);
  json status = context.daemon.ask(protocol::StatusRequest{});
  answer["daemon"] = status.at("daemon");
  json buses = json::array();
  for (const json& one : status.at("loops")) {
    buses.push_back({{"loop", one.at("name")},
                     {"io", one.at("io")},
                     {"recording", one.at("recording")},
                     {"pv_age_ms", one.value("pv_age_ms", json())}});
  }
  answer["loops"] = std::move(buses);
  answer["setups"] = setups_json(context.daemon);
  return json_response(answer);
}

}  // namespace loopwarden::page::api
