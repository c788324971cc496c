// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/plant_readings.hpp"

#include "daemon/loops/loop_health.hpp"

namespace loopwarden::daemon::console {

gateway::LoopReading PlantReadings::read(std::size_t loop) {
  const LoopRuntime& runtime = plant_.loops[loop];
  const rt::LoopChannels& channels = *runtime.channels;
  gateway::LoopReading reading(plant_.alarms.snapshot(loop));
  reading.running = plant_.historian.latest(loop, reading.row);
  reading.last_good_pv = plant_.historian.last_good_pv(loop);
  reading.set_point_wanted = channels.set_point_wanted.load(std::memory_order_relaxed);
  reading.availability = rt::unpacked(channels.availability.load(std::memory_order_acquire));
  reading.settings = runtime.settings->get();
  reading.moves = channels.moves.read();
  reading.orders_refused = channels.orders_refused.load(std::memory_order_relaxed);
  reading.ne107 = health_of(runtime.config, reading.row, reading.watch, plant_.severe_percent);
  reading.simulated = is_simulated(runtime.config);
  reading.dropped = channels.records.dropped() + channels.watched.dropped();
  return reading;
}

}  // namespace loopwarden::daemon::console
