// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/operator_commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <type_traits>
#include <utility>

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

namespace {

// Calls a handler of a group of commands. A handler that answers at once returns a struct.
template <auto kGroup, auto kHandler>
LocalServer::Answer call(OperatorCommands& to, const json& request, const Sender& from) {
  auto& group = to.*kGroup;
  const auto run = [&] {
    if constexpr (std::is_invocable_v<decltype(kHandler), decltype(group), const json&,
                                      const Sender&>) {
      return (group.*kHandler)(request, from);
    } else {
      return (group.*kHandler)(request);
    }
  };
  if constexpr (std::is_same_v<decltype(run()), LocalServer::Answer>) {
    return run();
  } else {
    return done(run());
  }
}

}  // namespace

const OperatorCommands::Command* OperatorCommands::find(std::string_view name) noexcept {
  using To = OperatorCommands;
  constexpr Access kControlOnly{};
  constexpr auto kLimited = [](Need need) { return Access{.on_limited = true, .need = need}; };
  static constexpr std::array kCommands{
      Command{"set", kLimited(Need::control), call<&To::loops_, &LoopCommands::set>},
      Command{"tune", kLimited(Need::tuning), call<&To::loops_, &LoopCommands::tune>},
      Command{"order", kLimited(Need::any), call<&To::loops_, &LoopCommands::order>},
      Command{"commissioning", kLimited(Need::tests),
              call<&To::sessions_, &SessionCommands::commissioning>},
      Command{"test_result", kLimited(Need::tests),
              call<&To::sessions_, &SessionCommands::test_result>},
      Command{"record", kControlOnly, call<&To::records_, &RecordCommands::record>},
      Command{"report", kLimited(Need::reports), call<&To::records_, &RecordCommands::report>},
      Command{"alarm", kLimited(Need::alarms), call<&To::alarms_, &AlarmCommands::alarm>},
      Command{"acknowledge_incident", kLimited(Need::alarms),
              call<&To::alarms_, &AlarmCommands::acknowledge_incident>},
      Command{"acknowledge_all", kLimited(Need::alarms),
              call<&To::alarms_, &AlarmCommands::acknowledge_all>},
      Command{"veto", kLimited(Need::alarms), call<&To::alarms_, &AlarmCommands::veto>},
      Command{"outcome", kControlOnly, call<&To::alarms_, &AlarmCommands::outcome>},
      Command{"note", kLimited(Need::alarms), call<&To::alarms_, &AlarmCommands::note>},
      Command{"reload", kLimited(Need::tests), call<&To::reloads_, &ReloadCommands::reload>},
      Command{"reload_state", kLimited(Need::tests),
              call<&To::reloads_, &ReloadCommands::reload_state>},
  };
  const auto* const found = std::find_if(kCommands.begin(), kCommands.end(),
                                         [&](const Command& c) { return c.name == name; });
  return found == kCommands.end() ? nullptr : found;
}

OperatorCommands::OperatorCommands(const Plant& plant, const Archive& archive,
                                   const DaemonInfo& info, Operations& operations,
                                   SessionClock clock)
    : loops_(plant, archive.journal, operations,
             [this](std::size_t loop, const std::string& peer) { records_.receipt(loop, peer); }),
      sessions_(plant, archive.journal, loops_, operations, std::move(clock)),
      records_(plant, archive, info),
      alarms_(plant, archive.journal,
              [this](std::size_t loop, const std::string& peer) { records_.receipt(loop, peer); }),
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
  sessions_.end_sessions(now);
  records_.end_records(now);
}

Access access_of(std::string_view request) {
  if (const Access* const access = OperatorCommands::access(request)) return *access;
  if (Readings::offers(request)) return {.on_status = true};
  throw RequestError(fmt::format("unknown request '{}'", request));
}

}  // namespace loopwarden::daemon::console
