// SPDX-License-Identifier: Apache-2.0
// What the registers of the map hold: their values by name, before they become words.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>

#include "daemon/gateway/loops_view.hpp"
#include "hal/modbus/modbus_settings.hpp"
#include "daemon/registers/register_map.hpp"

namespace loopwarden::daemon::gateway {

inline constexpr std::int64_t kMinute = 60'000;  // ms

// What the server itself knows; written by it, read into the map.
struct ServerState {
  bool writes_enabled = false;
  bool master_lost = false;
  std::uint16_t master_heartbeat = 0;
  bool master_beat = false;  // a master has written its heartbeat since this was last cleared
  std::uint16_t clients = 0;
  hal::modbus::ByteOrder word_order = hal::modbus::ByteOrder::abcd;
};

// The alarm of a field that stands once for each; of one that does not, the first, of no account.
alarm::AlarmKind alarm_of(const registers::Register& reg) noexcept;

// The plant at the moment of one request: every loop is read at most once. What it refers to outlives it.
class MapValues {
 public:
  MapValues(PlantView& plant, const ServerState& server) : plant_(plant), server_(server) {}

  // `index` counts only where `reg` belongs to a loop. Not finite: it is not known.
  double value(const registers::Register& reg, std::size_t index);

  const LoopReading& loop(std::size_t index);
  const BoxReading& box();

 private:
  // What the box's block needs of all loops.
  struct Totals {
    std::size_t active = 0;
    std::size_t unacknowledged = 0;
    std::size_t shelved = 0;
    std::uint64_t windows = 0;
    alarm::Ne107 ne107 = alarm::Ne107::normal;
  };
  const Totals& totals();
  double status_bits();

  PlantView& plant_;
  const ServerState& server_;
  std::map<std::size_t, LoopReading> read_;
  std::optional<BoxReading> box_;
  std::optional<Totals> totals_;
};

}  // namespace loopwarden::daemon::gateway
