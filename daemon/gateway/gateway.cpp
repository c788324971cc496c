// SPDX-License-Identifier: Apache-2.0
#include "daemon/gateway/gateway.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

namespace loopwarden::daemon::gateway {
namespace {

constexpr std::chrono::milliseconds kRound{100};
constexpr std::chrono::milliseconds kRoundWithOrders{10};  // while a loop has a command to answer
// Longest time for which the answer to an alarm action waits for the journal's line to be on the
// disk.
constexpr std::int64_t kDiskPatienceNs = 250'000'000;

base::PeerList peers_of(const GatewaySettings& settings) {
  std::vector<base::PeerRule> rules = settings.peers;
  for (base::PeerRule& rule : rules) rule.may_write = rule.may_write && settings.writes;
  return base::PeerList(std::move(rules));
}

}  // namespace

Gateway::Gateway(const GatewaySettings& settings, LoopsView& loops, base::Clock& clock)
    : loops_(loops),
      clock_(clock),
      master_(settings.master_heartbeat),
      master_watch_(settings.master_heartbeat),
      bank_(loops, state_),
      identity_{.revision = LOOPWARDEN_VERSION},
      server_(settings.tcp, peers_of(settings), clock,
              [this](std::span<const std::uint8_t> request, const Peer& peer) {
                return reply(request, peer);
              }) {
  state_.writes_enabled = settings.writes;
  state_.word_order = settings.word_order;
  shown_state_ = state_;
  if (settings.serial) {
    SerialServerSettings serial = *settings.serial;
    serial.writes = serial.writes && settings.writes;
    serial_ = std::make_unique<SerialServer>(
        std::move(serial), clock, [this](std::span<const std::uint8_t> request, const Peer& peer) {
          return reply(request, peer);
        });
  }
}

Reply Gateway::reply(std::span<const std::uint8_t> request, const Peer& peer) {
  const Pdu pdu = answer(request, bank_, identity_, peer);
  const std::uint64_t ticket = bank_.take_ticket();
  if (ticket == 0) return pdu;
  return {pdu, [this, ticket, until_ns = clock_.now_ns() + kDiskPatienceNs] {
            return loops_.settled(ticket) || clock_.now_ns() >= until_ns;
          }};
}

void Gateway::start() {
  thread_.start({.name = "lw-gateway"}, [this] {
    while (!quit_.load(std::memory_order_relaxed)) serve(kRound);
  });
}

void Gateway::stop() {
  quit_ = true;
  thread_.join();
  loops_.close_commands();
}

void Gateway::serve(std::chrono::milliseconds timeout) {
  try {
    if (loops_.collect_answers()) timeout = std::min(timeout, kRoundWithOrders);
    if (serial_) {
      server_.serve(std::min(timeout, serial_->patience()), serial_->fd());
      serial_->serve();
    } else {
      server_.serve(timeout);
    }
    watch_master();
  } catch (const std::exception& e) {
    spdlog::error("Modbus server: {}", e.what());
  }
  state_.clients = static_cast<std::uint16_t>(server_.counters().clients);
  {
    const std::lock_guard lock(counters_mutex_);
    counters_ = server_.counters();
    shown_state_ = state_;
    if (serial_) serial_counters_ = serial_->counters();
  }
  ticks_.fetch_add(1, std::memory_order_relaxed);
}

TcpServerCounters Gateway::counters() const {
  const std::lock_guard lock(counters_mutex_);
  return counters_;
}

std::optional<SerialServerCounters> Gateway::serial_counters() const {
  const std::lock_guard lock(counters_mutex_);
  return serial_counters_;
}

ServerState Gateway::state() const {
  const std::lock_guard lock(counters_mutex_);
  return shown_state_;
}

void Gateway::watch_master() {
  const MasterWatch::Event event =
      master_watch_.step(server_.read_ns(), state_.master_beat, state_.master_heartbeat);
  state_.master_beat = false;
  state_.master_lost = master_watch_.lost();
  if (event == MasterWatch::Event::none) return;
  if (event == MasterWatch::Event::back) {
    spdlog::info("Modbus master: its heartbeat is back");
    write_down_loss("master back");
    return;
  }
  spdlog::warn("Modbus master: no heartbeat for {:.3g} s", master_.timeout_s);
  write_down_loss("master lost");
  if (master_.action == MasterLossAction::report) return;
  const rt::Command command{.mode = master_.action == MasterLossAction::manual
                                        ? control::Mode::manual
                                        : control::Mode::automatic};
  for (std::size_t i = 0; i < loops_.loops(); ++i) {
    // Manual is also sent to loops that are being commissioned, because it is the safer mode.
    const bool manual = command.mode == control::Mode::manual;
    if (manual ? loops_.controlled_elsewhere(i) : loops_.read_only(i)) continue;
    if (loops_.read(i).availability.mode == command.mode)
      continue;  // in force already: not a command
    journal::JournalEntry line;
    line.kind = journal::JournalEntry::Kind::system;
    line.utc_ms = loops_.box().utc_ms;
    line.loop = loops_.name(i);
    line.what = "mode";
    line.new_value = command.mode == control::Mode::manual ? "0" : "1";
    line.reason = "master lost";
    if (loops_.has_room_for_command(i)) {
      loops_.send(i, command, {std::move(line)});
    } else {
      line.result = "refused: too many commands at once";
      loops_.write_down(std::move(line));
    }
  }
}

void Gateway::write_down_loss(const char* what) {
  journal::JournalEntry entry;
  entry.kind = journal::JournalEntry::Kind::system;
  entry.utc_ms = loops_.box().utc_ms;
  entry.what = what;
  constexpr const char* kActions[] = {"report", "manual", "automatic"};
  entry.result = kActions[static_cast<std::size_t>(master_.action)];
  loops_.write_down(std::move(entry));
}

}  // namespace loopwarden::daemon::gateway
