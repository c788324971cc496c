// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/watched_loops.hpp"

#include <utility>
#include <variant>

#include "base/group_access.hpp"
#include "daemon/app/real_time_loops.hpp"

namespace loopwarden::daemon {
namespace {

external::Wiring wiring_of(const config::Io& io) {
  const auto of = [](const auto& source) {
    return external::Wiring{.set_point = source.set_point.has_value(),
                            .stem = source.stem.has_value(),
                            .mode = source.mode.has_value(),
                            .mode_values = source.mode_values};
  };
  if (config::out_of_service(io) != nullptr) return {};
  if (const auto* feed = std::get_if<hal::feed::FeedSettings>(&io)) return of(*feed);
  return of(std::get<hal::modbus::ModbusSourceSettings>(io));
}

}  // namespace

void WatchedLoops::make(const config::Configuration& configuration, BackendFactory& backends,
                        std::vector<LoopRuntime>& loops) {
  std::vector<external::FeedServer::Right> rights;
  for (const auto& [name, user] : configuration.daemon.feeders) {
    board_.feeder(name);
    if (user.uid) rights.push_back({.feeder = name, .uid = *user.uid});
  }
  const double accelerate = configuration.daemon.accelerate;
  for (const config::LoopConfig& config : configuration.loops) {
    if (!config::is_watched(config.io)) continue;
    LoopRuntime loop;
    loop.config = config;
    const rt::LoopSettings settings = settings_of(config, config::backing_of(config.io));
    loop.source = backends.make_source(config, board_);
    loop.channels = std::make_unique<rt::LoopChannels>(room_of(config, configuration));
    loop.commissioning = std::make_unique<Commissioning>(*loop.channels);
    loop.settings = std::make_unique<CurrentSettings>(settings, *loop.channels);
    loop.watch = std::make_unique<external::WatchCycle>(static_cast<std::uint32_t>(loops.size()),
                                                        settings, wiring_of(config.io),
                                                        *loop.source, *loop.channels, events_);
    sampler_.add(*loop.watch, period_ns(config, accelerate));
    loops.push_back(std::move(loop));
  }
  if (configuration.daemon.feeders.empty()) return;
  const std::filesystem::path folder(configuration.daemon.runtime_directory);
  feed_ = std::make_unique<external::FeedServer>((folder / "feed.sock").string(), std::move(rights),
                                                 base::group_id("loopwarden-feed"), board_);
}

void WatchedLoops::start() {
  if (feed_) feed_->start();
  if (!sampler_.empty()) sampler_.start();
}

void WatchedLoops::stop() noexcept {
  if (feed_) feed_->stop();
  sampler_.stop();
}

std::vector<protocol::FeederStatus> WatchedLoops::feeders(std::int64_t now_ns) const {
  std::vector<protocol::FeederStatus> all;
  for (const auto& [name, feeder] : board_.feeders()) {
    const hal::feed::Feeder::Counters& c = feeder->counters();
    const std::int64_t alive_ns = feeder->alive_ns();
    all.push_back({.name = name,
                   .connected = c.connected.load(std::memory_order_relaxed),
                   .lines = c.lines.load(std::memory_order_relaxed),
                   .bad_lines = c.bad_lines.load(std::memory_order_relaxed),
                   .values = c.values.load(std::memory_order_relaxed),
                   .unknown_names = c.unknown_names.load(std::memory_order_relaxed),
                   .doubled = c.doubled.load(std::memory_order_relaxed),
                   .out_of_order = c.out_of_order.load(std::memory_order_relaxed),
                   .connections = c.connections.load(std::memory_order_relaxed),
                   .silent_s = alive_ns == 0 ? protocol::kNone
                                             : static_cast<double>(now_ns - alive_ns) * 1e-9,
                   .clock_behind_s = c.clock_behind_s.load(std::memory_order_relaxed)});
  }
  return all;
}

}  // namespace loopwarden::daemon
