// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "base/newest_value.hpp"
#include "base/spsc_ring.hpp"
#include "daemon/rt/loop_settings.hpp"
#include "daemon/rt/command.hpp"
#include "daemon/rt/planned_moves_status.hpp"
#include "record/record_row.hpp"

namespace loopwarden::daemon::rt {

// All data of one loop that crosses the border of the real-time thread. Each comment ends with
// writer -> reader; daemon/README.md lists the threads.
struct LoopChannels {
  // Sizes of the rings.
  struct Room {
    std::size_t records = 64;  // cycles
    std::size_t watched = 64;  // cycles
    std::size_t moves_samples = 64;
    std::size_t master_commands = CommandMailbox::kRoom;
    std::size_t monitor_commands = CommandMailbox::kRoom;
  };
  explicit LoopChannels(const Room& room)
      : master_commands(room.master_commands),
        monitor_commands(room.monitor_commands),
        records(room.records),
        watched(room.watched),
        moves_samples(room.moves_samples) {}

  base::NewestValue<SettingsOffer> settings;  // reload -> cycle
  // Settings from the files and gains from commands, without the operator's changes of the jacket;
  // cycle -> CurrentSettings
  base::NewestValue<LoopSettings> in_force;
  CommandMailbox operator_commands;           // operator <-> cycle
  CommandMailbox master_commands;             // Modbus master <-> cycle
  CommandMailbox monitor_commands;            // monitor <-> cycle
  base::SpscRing<record::RecordRow> records;  // cycle -> historian
  base::SpscRing<record::RecordRow> watched;  // cycle -> monitor
  // One per cycle in which planned moves run; cycle -> monitor
  base::SpscRing<control::MovesSample> moves_samples;
  std::atomic<bool> moves_run{false};                       // cycle -> monitor
  base::NewestValue<control::MovesRequest> moves_requests;  // monitor -> cycle
  // Availability for the next command, packed; cycle -> operator, Modbus server
  std::atomic<std::uint8_t> availability{0};
  // Commands that were accepted, but refused when the cycle took them; cycle -> status
  std::atomic<std::uint32_t> orders_refused{0};
  // Settings for the next command of planned moves; monitor -> cycle
  base::NewestValue<control::PlannedMovesSettings> moves_settings;
  // Number of the offer in force, 0 before the first. Each offer resets jacket and compensator to
  // their file; cycle -> reload, monitor
  std::atomic<std::uint32_t> settings_taken{0};
  // Number of the offer that waits until the output is inside its limits or until a commissioning
  // ends, 0 without one; cycle -> reload
  std::atomic<std::uint32_t> settings_waiting{0};
  // Number of the newest offer or withdrawal that the cycle received. Older offers are dropped;
  // cycle -> reload
  std::atomic<std::uint32_t> settings_seen{0};
  // Published with `availability`, before the answer to a command; cycle -> operator, Modbus server
  std::atomic<double> set_point_wanted{0.0};  // PV units
  std::atomic<double> output_wanted{0.0};     // CO units, target in manual; NaN: unknown
  std::atomic<float> position_age_ms{-1.0F};  // cycle -> status; negative: no position
  PlannedMovesStatus moves;                   // monitor -> status, Modbus server
  std::atomic<bool> stop_reached{false};      // the stop action is complete; cycle -> main
  // Until this time (CLOCK_MONOTONIC) no command is written in manual, so that the watchdog of the
  // device acts. The cycle resets it to 0 when it takes a command for an output;
  // commissioning -> cycle
  std::atomic<std::int64_t> withheld_until_ns{0};
  // A commissioning holds the loop: offered settings wait; Commissioning -> cycle
  std::atomic<bool> commissioned{false};
};

}  // namespace loopwarden::daemon::rt
