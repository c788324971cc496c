// SPDX-License-Identifier: Apache-2.0
#include "workbench/live/daemon_client.hpp"

#include <chrono>
#include <limits>
#include <stdexcept>
#include <thread>
#include <utility>

namespace loopwarden::workbench {
namespace {

std::vector<double> numbers(const nlohmann::json& array) {
  std::vector<double> values;
  values.reserve(array.size());
  for (const auto& v : array) {
    values.push_back(v.is_number() ? v.get<double>() : std::numeric_limits<double>::quiet_NaN());
  }
  return values;
}

}  // namespace

nlohmann::json DaemonClient::ask(const nlohmann::json& request) {
  nlohmann::json answer =
      nlohmann::json::parse(client_.request(request.dump(), std::chrono::milliseconds(3000)));
  if (!answer.value("ok", false)) {
    throw DaemonRefused(kExitData,
                        "the daemon refused: " + answer.value("error", std::string("no reason")));
  }
  return answer;
}

nlohmann::json DaemonClient::status() { return ask({{"request", "status"}}); }

Trend DaemonClient::trend(const std::string& loop, std::uint64_t from) {
  const nlohmann::json answer = ask({{"request", "trend"}, {"loop", loop}, {"from", from}});
  return {.sample_time_s = answer.at("sample_time_s").get<double>(),
          .period = answer.at("period").get<std::vector<std::uint64_t>>(),
          .sp = numbers(answer.at("sp")),
          .pv = numbers(answer.at("pv")),
          .co = numbers(answer.at("co")),
          .stem = numbers(answer.at("stem"))};
}

bool DaemonClient::set(const std::string& loop, nlohmann::json request,
                       std::chrono::milliseconds for_disk) {
  using Clock = std::chrono::steady_clock;
  using Seconds = std::chrono::duration<double>;
  constexpr std::chrono::milliseconds kBetweenLooks{5};
  request["request"] = "set";
  request["loop"] = loop;
  const nlohmann::json sent = ask(request);
  if (!sent.contains("order")) return true;  // an older daemon does not tell
  const Clock::time_point start = Clock::now();
  const Seconds patience(5.0 + 3.0 * sent.at("sample_time_s").get<double>());
  for (;;) {
    const nlohmann::json now =
        ask({{"request", "order"}, {"loop", loop}, {"order", sent.at("order")}});
    const std::string state = now.at("state");
    if (state == "refused") {
      throw DaemonRefused(kExitData, "the loop refused: " + now.at("why").get<std::string>());
    }
    const bool done = state == "done";
    if (done && (now.at("on_disk") || Clock::now() - start > for_disk)) return now.at("on_disk");
    if (!done && Clock::now() - start > patience) {
      throw OrderNotTaken("loop '" + loop + "' has not taken the order yet");
    }
    std::this_thread::sleep_for(kBetweenLooks);
  }
}

std::uint64_t DaemonClient::reload(bool dry_run) {
  return ask({{"request", "reload"}, {"dry_run", dry_run}}).at("reload").get<std::uint64_t>();
}

nlohmann::json DaemonClient::reload_state(std::uint64_t number) {
  return ask({{"request", "reload_state"}, {"reload", number}});
}

std::string DaemonClient::start_record(const std::string& loop, const std::string& name) {
  return ask({{"request", "record"}, {"loop", loop}, {"start", name}})
      .at("file")
      .get<std::string>();
}

std::string DaemonClient::stop_record(const std::string& loop) {
  return ask({{"request", "record"}, {"loop", loop}, {"stop", true}}).at("file").get<std::string>();
}

nlohmann::json DaemonClient::alarms() { return ask({{"request", "alarms"}}); }

nlohmann::json DaemonClient::act(const std::string& loop, nlohmann::json order) {
  order["request"] = "alarm";
  order["loop"] = loop;
  return ask(order);
}

nlohmann::json DaemonClient::explain(const std::string& loop, const std::string& alarm) {
  return ask({{"request", "explain"}, {"loop", loop}, {"alarm", alarm}});
}

nlohmann::json DaemonClient::veto(const std::string& loop, bool veto, const std::string& reason) {
  return ask({{"request", "veto"}, {"loop", loop}, {"veto", veto}, {"reason", reason}});
}

nlohmann::json DaemonClient::outcome(const std::string& loop, const std::string& found,
                                     const std::string& note) {
  nlohmann::json request = {{"request", "outcome"}, {"loop", loop}, {"found", found}};
  if (!note.empty()) request["note"] = note;
  return ask(request);
}

nlohmann::json DaemonClient::journal(std::size_t most, const std::string& loop,
                                     const std::string& text) {
  nlohmann::json request = {{"request", "journal"}, {"most", most}};
  if (!loop.empty()) request["loop"] = loop;
  if (!text.empty()) request["text"] = text;
  return ask(request).at("lines");
}

}  // namespace loopwarden::workbench
