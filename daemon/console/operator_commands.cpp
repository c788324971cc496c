// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/operator_commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "daemon/console/readings.hpp"
#include "daemon/console/request.hpp"

namespace loopwarden::daemon::console {

using base::LocalServer;
using nlohmann::json;

struct OperatorCommands::Command {
  std::string_view name;
  Access access;
  LocalServer::Answer (*handle)(OperatorCommands& to, const json& request, const Sender& from);
};

const OperatorCommands::Command* OperatorCommands::find(std::string_view name) noexcept {
  using To = OperatorCommands;
  constexpr Access kControlOnly{};
  constexpr auto kLimited = [](Need need) { return Access{.on_limited = true, .need = need}; };
  static constexpr std::array kCommands{
      Command{"set", kLimited(Need::control),
              [](To& to, const json& request, const Sender& from) -> LocalServer::Answer {
                return done(to.loops_.set(request, from));
              }},
      Command{"tune", kLimited(Need::tuning),
              [](To& to, const json& request, const Sender& from) -> LocalServer::Answer {
                return done(to.loops_.tune(request, from));
              }},
      Command{"order", kLimited(Need::any),
              [](To& to, const json& request, const Sender&) -> LocalServer::Answer {
                return done(to.loops_.order(request));
              }},
      Command{"commissioning", kControlOnly,
              [](To& to, const json& request, const Sender& from) -> LocalServer::Answer {
                return done(to.sessions_.commissioning(request, from));
              }},
      Command{"record", kControlOnly,
              [](To& to, const json& request, const Sender& from) -> LocalServer::Answer {
                return done(to.records_.record(request, from));
              }},
      Command{"report", kLimited(Need::reports),
              [](To& to, const json& request, const Sender& from) {
                return to.records_.report(request, from);
              }},
      Command{"alarm", kLimited(Need::alarms),
              [](To& to, const json& request, const Sender& from) {
                return to.alarms_.alarm(request, from);
              }},
      Command{"acknowledge_incident", kLimited(Need::alarms),
              [](To& to, const json& request, const Sender& from) {
                return to.alarms_.acknowledge_incident(request, from);
              }},
      Command{"acknowledge_all", kLimited(Need::alarms),
              [](To& to, const json& request, const Sender& from) {
                return to.alarms_.acknowledge_all(request, from);
              }},
      Command{"veto", kLimited(Need::alarms),
              [](To& to, const json& request, const Sender& from) {
                return to.alarms_.veto(request, from);
              }},
      Command{"outcome", kControlOnly,
              [](To& to, const json& request, const Sender& from) {
                return to.alarms_.outcome(request, from);
              }},
      Command{"note", kLimited(Need::alarms),
              [](To& to, const json& request, const Sender& from) {
                return to.alarms_.note(request, from);
              }},
      Command{"reload", kControlOnly,
              [](To& to, const json& request, const Sender& from) -> LocalServer::Answer {
                return done(to.reloads_.reload(request, from));
              }},
      Command{"reload_state", kControlOnly,
              [](To& to, const json& request, const Sender&) -> LocalServer::Answer {
                return done(to.reloads_.reload_state(request));
              }},
  };
  const auto* const found = std::find_if(kCommands.begin(), kCommands.end(),
                                         [&](const Command& c) { return c.name == name; });
  return found == kCommands.end() ? nullptr : found;
}

OperatorCommands::OperatorCommands(const Plant& plant, const Archive& archive,
                                   const DaemonInfo& info, Operations& operations)
    : loops_(plant, archive.journal, operations),
      sessions_(plant, archive.journal, loops_),
      records_(plant, archive, info),
      alarms_(plant, archive.journal),
      reloads_(operations) {}

const Access* OperatorCommands::access(std::string_view name) noexcept {
  const Command* const command = find(name);
  return command == nullptr ? nullptr : &command->access;
}

LocalServer::Answer OperatorCommands::answer(std::string_view name, const json& request,
                                             const Sender& sender) {
  const Command* const command = find(name);
  if (command == nullptr) throw RequestError("unknown request '" + std::string(name) + "'");
  return command->handle(*this, request, sender);
}

void OperatorCommands::collect(Commissioning::Clock::time_point now) {
  loops_.collect();
  sessions_.end_silent(now);
  records_.end_records(now);
}

Access access_of(std::string_view request) {
  if (const Access* const access = OperatorCommands::access(request)) return *access;
  if (Readings::offers(request)) return {.on_status = true};
  throw RequestError(fmt::format("unknown request '{}'", request));
}

}  // namespace loopwarden::daemon::console
