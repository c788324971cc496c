// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/real_time_loops.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

#include "base/real_time.hpp"
#include "model/effects/catalogue.hpp"

namespace loopwarden::daemon {
namespace {

effects::EffectChain valve_model_of(const config::LoopConfig& loop) {
  effects::EffectChain chain;
  effects::EffectContext context{.sample_time_s = loop.sample_time_s,
                                 .output_low = loop.controller.pid.output_low,
                                 .output_high = loop.controller.pid.output_high,
                                 .seed = 1};
  for (const effects::EffectSpec& spec : loop.valve_position.model) {
    chain.add(effects::make_effect(spec, context));
  }
  return chain;
}

rt::ValvePositionSource source_of(const config::ValvePosition& position) {
  switch (position.source) {
    case config::ValvePosition::Source::read_back: return rt::ValvePositionSource::read_back;
    case config::ValvePosition::Source::model: return rt::ValvePositionSource::model;
    case config::ValvePosition::Source::none: break;
  }
  return rt::ValvePositionSource::none;
}

}  // namespace

// Sizes the queues for the monitor's longest delay: windows and routine evidence of all loops may
// be full at the same moment. Judging takes 8 ms per loop, and 20 ms on a slow host.
rt::LoopChannels::Room room_of(const config::LoopConfig& loop,
                               const config::Configuration& configuration) {
  constexpr double kHistorianLate_s = 5.0;
  constexpr double kMonitorLate_s = 10.0;
  constexpr double kJudging_s = 0.02;  // per loop
  const auto cycles = [&](double late_s) {
    return static_cast<std::size_t>(late_s / loop.sample_time_s * configuration.daemon.accelerate) +
           8;
  };
  const auto loops = static_cast<double>(configuration.loops.size());
  const std::size_t watched = cycles(kMonitorLate_s + kJudging_s * loops);
  return {.records = cycles(kHistorianLate_s),
          .watched = watched,
          .moves_samples = config::is_watched(loop.io) ? 1 : watched,
          .master_commands = configuration.daemon.modbus_server ? rt::CommandMailbox::kRoom : 1,
          .monitor_commands = loop.monitor.corrective.enabled ? rt::CommandMailbox::kRoom : 1};
}

std::uint32_t moves_lease(const config::LoopConfig& loop, double accelerate) {
  constexpr double kLease_s = 5.0;  // the monitor's turns come every 50 ms
  constexpr double kLeastCycles = 3.0;
  return static_cast<std::uint32_t>(
      std::max(kLeastCycles, std::ceil(kLease_s / loop.sample_time_s * accelerate)));
}

std::int64_t period_ns(const config::LoopConfig& loop, double accelerate) {
  return std::llround(loop.sample_time_s / accelerate * 1e9);
}

void RealTimeLoops::lock_memory() { rights_missing_ = base::lock_memory(); }

void RealTimeLoops::make(const config::Configuration& configuration, const Starts& start) {
  const double accelerate = configuration.daemon.accelerate;
  std::int64_t tick_ns = 0;
  for (const config::LoopConfig& loop : configuration.loops) {
    if (!config::is_watched(loop.io)) tick_ns = std::gcd(tick_ns, period_ns(loop, accelerate));
  }
  // Without loops to control, the thread keeps a default period.
  if (tick_ns == 0) tick_ns = base::kNanosecondsPerSecond;
  runner_ = std::make_unique<rt::CyclicRunner>(clock_, tick_ns);

  loops_.reserve(configuration.loops.size());
  for (const config::LoopConfig& config : configuration.loops) {
    if (config::is_watched(config.io)) continue;
    LoopRuntime loop;
    loop.config = config;
    const rt::LoopSettings settings = settings_of(config, config::backing_of(config.io));
    loop.io = backends_.make(config);
    loop.channels = std::make_unique<rt::LoopChannels>(room_of(config, configuration));
    loop.commissioning = std::make_unique<Commissioning>(*loop.channels);
    loop.settings = std::make_unique<CurrentSettings>(settings, *loop.channels);
    loop.cycle = std::make_unique<rt::ControlCycle>(
        static_cast<std::uint32_t>(loops_.size()), config.sample_time_s, settings, start(config),
        source_of(config.valve_position), valve_model_of(config), *loop.io, *loop.channels,
        events_);
    loops_.push_back(std::move(loop));
    runner_->add(*loops_.back().cycle,
                 static_cast<std::uint64_t>(period_ns(config, accelerate) / tick_ns));
  }
}

void RealTimeLoops::start(const config::RealTime& rights) {
  const std::string refused = thread_.start(
      {.name = "lw-loops", .fifo_priority = rights.priority, .cpu = rights.cpu}, [this] {
        base::prefault_stack();
        runner_->run(stop_, quit_);
      });
  if (refused.empty()) return;
  const std::lock_guard lock(status_mutex_);
  rights_missing_ += (rights_missing_.empty() ? "" : "; ") + refused +
                     ": other load on the host may delay the loops; raise LimitRTPRIO";
}

bool RealTimeLoops::all_stopped() const noexcept {
  return std::all_of(loops_.begin(), loops_.end(), [](const LoopRuntime& loop) {
    return loop.watched() || loop.channels->stop_reached.load(std::memory_order_acquire);
  });
}

void RealTimeLoops::end() noexcept {
  quit_ = true;
  thread_.join();
}

rt::RunnerStatus RealTimeLoops::publish_status() {
  const rt::RunnerStatus now = runner_->status();
  const std::lock_guard lock(status_mutex_);
  status_ = now;
  return now;
}

rt::RunnerStatus RealTimeLoops::status() const {
  const std::lock_guard lock(status_mutex_);
  return status_;
}

std::string RealTimeLoops::rights_missing() const {
  const std::lock_guard lock(status_mutex_);
  return rights_missing_;
}

}  // namespace loopwarden::daemon
