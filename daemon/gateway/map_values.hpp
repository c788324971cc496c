// SPDX-License-Identifier: Apache-2.0
// Values of the registers by name, before they are encoded as words.
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

// State of the server itself. The server writes it; the map contains it.
struct ServerState {
  bool writes_enabled = false;
  bool master_lost = false;
  std::uint16_t master_heartbeat = 0;
  bool master_beat = false;  // a master has written its heartbeat since this flag was cleared
  std::uint16_t clients = 0;
  hal::modbus::ByteOrder word_order = hal::modbus::ByteOrder::abcd;
};

// Returns the alarm of a field that exists once per alarm. For other fields it returns the first
// alarm, which is ignored.
alarm::AlarmKind alarm_of(const registers::Register& reg) noexcept;

// The plant at the time of one request. Every loop is read at most once. Referenced objects must
// outlive it.
class MapValues {
 public:
  MapValues(PlantView& plant, const ServerState& server) : plant_(plant), server_(server) {}

  // Returns the value. `index` is used only if `reg` belongs to a loop. Not finite: unknown.
  double value(const registers::Register& reg, std::size_t index);

  const LoopReading& loop(std::size_t index);
  const BoxReading& box();

 private:
  // Sums over all loops for the box's block.
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
