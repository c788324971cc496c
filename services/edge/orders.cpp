// SPDX-License-Identifier: Apache-2.0
#include "services/edge/orders.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

namespace loopwarden::edge {
namespace {

constexpr std::chrono::milliseconds kOrderPatience{2000};
constexpr std::chrono::seconds kLongestWait{60};
constexpr std::size_t kMostOrders = 100;

const char* outcome_of(const nlohmann::json& answer) {
  return answer.value("on_disk", true) ? "done" : "done, the journal does not have it yet";
}
std::string outcome_of(const DaemonAway& e) {
  return fmt::format(
      "{}: {}",
      e.may_be_done() ? "not known" : "refused: no socket for orders (loopwardend.yaml: edge)",
      e.what());
}
std::string outcome_of(const nlohmann::json::exception& e) {
  return fmt::format("not known: the daemon answers in another way than expected: {}", e.what());
}

}  // namespace

Orders::Orders(const std::filesystem::path& runtime_directory, bool allowed)
    : link_((runtime_directory / "edge.sock").string(), kOrderPatience), allowed_(allowed) {}

void Orders::give(const std::string& device, const std::string& tag, const Order& order) {
  const auto end = [&](const std::string& how) {
    spdlog::info("{}: {}: {}", tag, order.what, how);
    done_.push_back({device, order.what + ": " + how});
  };
  if (!allowed_) return end("refused: edge.yaml has no orders: true");
  if (waiting_.size() >= kMostOrders) return end("refused: too many orders wait");
  nlohmann::json request = order.request;
  request["loop"] = tag;
  request["user"] = "sparkplug";
  try {
    const nlohmann::json answer = link_.ask(request);
    if (!answer.contains("order")) {
      return end(outcome_of(answer));
    }
    waiting_.push_back({device, tag, order.what, answer.at("order").get<std::uint64_t>(),
                        std::chrono::steady_clock::now()});
  } catch (const DaemonRefused& e) {
    end(fmt::format("refused: {}", e.what()));
  } catch (const DaemonAway& e) {
    end(outcome_of(e));
  } catch (const nlohmann::json::exception& e) {
    end(outcome_of(e));
  }
}

void Orders::acknowledge_all(const std::vector<Loop>& loops) {
  const auto tell = [&](const std::string& outcome) {
    for (const Loop& loop : loops) {
      if (loop.waits) refuse(loop.device, "acknowledge_all: " + outcome);
    }
  };
  if (!allowed_) return tell("refused: edge.yaml has no orders: true");
  try {
    const nlohmann::json answer =
        link_.ask({{"request", "acknowledge_all"}, {"user", "sparkplug"}});
    const char* how = outcome_of(answer);
    for (const nlohmann::json& alarm : answer.at("acknowledged")) {
      const auto tag = alarm.at("loop").get<std::string>();
      const auto loop =
          std::find_if(loops.begin(), loops.end(), [&](const Loop& l) { return l.tag == tag; });
      if (loop == loops.end()) continue;
      const auto what = "acknowledge_" + alarm.at("alarm").get<std::string>();
      spdlog::info("{}: {}: {}", tag, what, how);
      done_.push_back({loop->device, fmt::format("{}: {}", what, how)});
    }
  } catch (const DaemonRefused& e) {
    tell(fmt::format("refused: {}", e.what()));
  } catch (const DaemonAway& e) {
    tell(outcome_of(e));
  } catch (const nlohmann::json::exception& e) {
    tell(outcome_of(e));
  }
}

bool Orders::ask_after(const Waiting& order) {
  const auto end = [&](const std::string& how) {
    spdlog::info("{}: {}: {}", order.tag, order.what, how);
    done_.push_back({order.device, order.what + ": " + how});
    return true;
  };
  try {
    const nlohmann::json answer =
        link_.ask({{"request", "order"}, {"loop", order.tag}, {"order", order.number}});
    const auto state = answer.at("state").get<std::string>();
    if (state == "done") return end("done");
    if (state == "refused") return end("refused: " + answer.value("why", std::string()));
  } catch (const std::exception& e) {
    return end(fmt::format("not known: {}", e.what()));
  }
  return std::chrono::steady_clock::now() - order.since > kLongestWait &&
         end("not known: no cycle took it");
}

std::vector<Orders::Outcome> Orders::outcomes() {
  std::erase_if(waiting_, [this](const Waiting& order) { return ask_after(order); });
  return std::exchange(done_, {});
}

}  // namespace loopwarden::edge
