// SPDX-License-Identifier: Apache-2.0
#include "services/edge/orders.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>
#include <variant>

#include "daemon/protocol/ask.hpp"

namespace loopwarden::edge {
namespace {

constexpr std::chrono::milliseconds kOrderPatience{2000};
constexpr std::chrono::seconds kLongestWait{60};
constexpr std::size_t kMostOrders = 100;
constexpr const char* kUser = "sparkplug";

const char* done(bool on_disk) { return on_disk ? "done" : "done, not yet in the journal"; }
std::string outcome_of(const protocol::DaemonError& e) {
  using Kind = protocol::DaemonError::Kind;
  switch (e.kind()) {
    case Kind::refused:
    case Kind::not_yet: return fmt::format("refused: {}", e.what());
    case Kind::down:
      return fmt::format("refused: no socket for commands (loopwardend.yaml: edge): {}", e.what());
    case Kind::not_known: break;
  }
  return fmt::format("not known: {}", e.what());
}

}  // namespace

Orders::Orders(const std::filesystem::path& runtime_directory, bool allowed)
    : daemon_((runtime_directory / "edge.sock").string(), kOrderPatience), allowed_(allowed) {}

void Orders::give(const std::string& device, const std::string& tag, const Order& order) {
  const auto end = [&](const std::string& how) {
    spdlog::info("{}: {}: {}", tag, order.what, how);
    done_.push_back({device, order.what + ": " + how});
  };
  if (!allowed_) return end("refused: edge.yaml has no orders: true");
  if (waiting_.size() >= kMostOrders) return end("refused: too many commands wait");
  try {
    const auto give = [&](auto request) {
      request.loop = tag;
      request.user = kUser;
      return ask(daemon_, request);
    };
    if (const auto* set = std::get_if<protocol::SetRequest>(&order.request)) {
      waiting_.push_back(
          {device, tag, order.what, give(*set).order, std::chrono::steady_clock::now()});
    } else if (const auto* veto = std::get_if<protocol::VetoRequest>(&order.request)) {
      end(done(give(*veto).on_disk));
    } else {
      end(done(give(std::get<protocol::AlarmRequest>(order.request)).on_disk));
    }
  } catch (const protocol::DaemonError& e) {
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
    protocol::AcknowledgeAllRequest request;
    request.user = kUser;
    const auto answer = ask(daemon_, request);
    const char* how = done(answer.on_disk);
    for (const auto& [tag, alarm] : answer.acknowledged) {
      const auto loop = std::find_if(loops.begin(), loops.end(),
                                     [&tag = tag](const Loop& l) { return l.tag == tag; });
      if (loop == loops.end()) continue;
      const auto what = "acknowledge_" + alarm;
      spdlog::info("{}: {}: {}", tag, what, how);
      done_.push_back({loop->device, fmt::format("{}: {}", what, how)});
    }
  } catch (const protocol::DaemonError& e) {
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
    const auto now = ask(daemon_, protocol::OrderRequest{order.tag, order.number});
    if (now.state == "done") return end("done");
    if (now.state == "refused") return end("refused: " + (now.outcome ? now.outcome->why : ""));
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
