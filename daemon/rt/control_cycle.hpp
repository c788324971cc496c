// SPDX-License-Identifier: Apache-2.0
// One loop, one period: from the newest sample to the newest command; the backend's thread speaks to the devices.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>

#include "daemon/rt/event.hpp"
#include "daemon/rt/loop_settings.hpp"
#include "daemon/rt/order.hpp"
#include "daemon/rt/pv_guard.hpp"
#include "hal/contract/loop_io.hpp"
#include "base/newest_value.hpp"
#include "base/spsc_ring.hpp"
#include "record/record_row.hpp"
#include "model/control/loop_controller.hpp"
#include "model/control/supervisor.hpp"
#include "model/plant/effect.hpp"

namespace loopwarden::daemon::rt {

// What planned_moves does, for any number of readers; one value may be a cycle older than the next.
class MovesBoard {
 public:
  void publish(const control::MovesState& state) noexcept {
    expected_offset_.store(state.expected_offset, std::memory_order_relaxed);
    action_threshold_.store(state.action_threshold, std::memory_order_relaxed);
    output_.store(state.output, std::memory_order_relaxed);
    gain_.store(state.gain, std::memory_order_relaxed);
    // What a reader decides by, in one word: no half of it is older than the other.
    what_.store({.run = true,
                 .shadow = state.shadow,
                 .latched = state.latched,
                 .waits = state.waits,
                 .cycles_watched = state.cycles_watched,
                 .phase = state.phase,
                 .reason = state.reason},
                std::memory_order_release);
  }
  void none() noexcept { what_.store({}, std::memory_order_relaxed); }
  // Nothing: there are none.
  std::optional<control::MovesState> read() const noexcept {
    const What what = what_.load(std::memory_order_acquire);
    if (!what.run) return std::nullopt;
    control::MovesState state;
    state.shadow = what.shadow;
    state.latched = what.latched;
    state.waits = what.waits;
    state.cycles_watched = what.cycles_watched;
    state.phase = what.phase;
    state.reason = what.reason;
    state.expected_offset = expected_offset_.load(std::memory_order_relaxed);
    state.action_threshold = action_threshold_.load(std::memory_order_relaxed);
    state.output = output_.load(std::memory_order_relaxed);
    state.gain = gain_.load(std::memory_order_relaxed);
    return state;
  }

 private:
  struct alignas(8) What {
    bool run = false;
    bool shadow = false;
    bool latched = false;
    bool waits = false;
    std::uint8_t cycles_watched = 0;
    control::MovePhase phase = control::MovePhase::watching;
    control::DisengageReason reason = control::DisengageReason::none;
    std::uint8_t rest = 0;  // no bit of the word is left open
  };
  static_assert(std::atomic<What>::is_always_lock_free);
  std::atomic<What> what_{What{}};
  std::atomic<double> expected_offset_{0.0};
  std::atomic<double> action_threshold_{0.0};
  std::atomic<double> output_{0.0};
  std::atomic<double> gain_{0.0};
};

// Everything that crosses the border of the real-time thread, for one loop. daemon/README.md names
// the threads at the other ends.
struct LoopChannels {
  struct Room {
    std::size_t records = 64;  // cycles
    std::size_t watched = 64;  // cycles
    std::size_t monitor_orders = OrderBox::kRoom;
  };
  explicit LoopChannels(const Room& room)
      : monitor_orders(room.monitor_orders), records(room.records), watched(room.watched) {}

  base::NewestValue<SettingsOffer> settings;  // reload -> cycle
  // As the files and ordered gains have them, without what was ordered of the jacket;
  // cycle -> CurrentSettings
  base::NewestValue<LoopSettings> in_force;
  OrderBox operator_orders;                   // operator <-> cycle
  OrderBox master_orders;                     // Modbus master <-> cycle
  OrderBox monitor_orders;                    // monitor <-> cycle
  base::SpscRing<record::RecordRow> records;  // cycle -> historian
  base::SpscRing<record::RecordRow> watched;  // cycle -> monitor
  // What the next order will find: packed(Standing); cycle -> operator, Modbus server
  std::atomic<std::uint8_t> standing{0};
  // Orders that had been let in and could not act any more when they were taken; cycle -> status
  std::atomic<std::uint32_t> orders_refused{0};
  // Of the next order for planned moves; monitor -> cycle
  base::NewestValue<control::PlannedMovesSettings> moves_settings;
  // Number of the offer in force, 0 before the first: each sets jacket and compensator as their file has them, whatever
  // was ordered; cycle -> reload, monitor
  std::atomic<std::uint32_t> settings_taken{0};
  // Number of the offer that waits until the output is inside its limits, or a commissioning has
  // ended; 0: none; cycle -> reload
  std::atomic<std::uint32_t> settings_waiting{0};
  // Number of the newest offer or withdrawal that the cycle has seen: an older one is not taken any
  // more; cycle -> reload
  std::atomic<std::uint32_t> settings_seen{0};
  // Published with `standing`, before an order is answered; cycle -> operator, Modbus server
  std::atomic<double> set_point_wanted{0.0};  // PV units
  std::atomic<double> output_wanted{0.0};  // CO units, what manual holds or goes to; NaN: not known
  std::atomic<float> position_age_ms{-1.0F};  // cycle -> status; below 0: none
  MovesBoard moves;                           // cycle -> monitor, status
  std::atomic<bool> stop_reached{false};      // cycle -> main: output is where it ends
  // Until then (CLOCK_MONOTONIC) no command goes out in manual, so that the device's watchdog acts.
  // Set by the commissioning; the cycle sets it to 0 when it takes an order for an output.
  std::atomic<std::int64_t> withheld_until_ns{0};
  // Out of service for everybody else: offered settings wait. Written by Commissioning, together
  // with its holder.
  std::atomic<bool> commissioned{false};
};

// How the loop begins.
struct StartSettings {
  control::Mode mode = control::Mode::manual;
  double set_point = 0.0;  // PV units
  // Used where no read-back tells; hold: the output is not known until the operator sets one.
  control::OutputAction output;
};

// Where u_valve of the jacket comes from.
enum class ValvePositionSource : std::uint8_t { none, read_back, model };

class ControlCycle {
 public:
  // `events` is shared by all loops of the real-time thread. Everything referred to outlives this.
  ControlCycle(std::uint32_t loop, double period_s, const LoopSettings& settings,
               const StartSettings& start, ValvePositionSource valve_source,
               plant::EffectChain valve_model, hal::LoopIo& io, LoopChannels& channels,
               base::SpscRing<Event>& events);

  // Real-time thread. `missed`: periods skipped since the last call; `stop`: the daemon is ending.
  void run(const hal::CycleTime& time, std::uint64_t missed, bool stop) noexcept;

 private:
  void take_settings() noexcept;
  void publish_in_force() noexcept;
  void take_orders() noexcept;
  void answer(OrderBox& box) noexcept;
  Refusal take(const Order& order, const InForce& now) noexcept;
  InForce in_force() const noexcept;
  void apply(const Order& order) noexcept;
  void apply(JacketWish wish) noexcept;
  void apply(MovesWish wish) noexcept;
  Standing standing() const noexcept;
  void publish_standing() noexcept;
  control::Conditions conditions(const hal::Sample& pv, std::uint64_t missed,
                                 bool stop) const noexcept;
  bool read_back_good() const noexcept;
  void withhold(bool stop) noexcept;
  void learn_output(const control::Conditions& found, const control::Decision& decision) noexcept;
  void learn(double output) noexcept;
  double known_output() const noexcept;  // NaN: not known
  control::ControllerOutput decide(const control::Decision& decision,
                                   const hal::Sample& pv) noexcept;
  hal::Command checked(const control::ControllerOutput& out, const control::Decision& decision,
                       double output_before) noexcept;
  void record(const hal::CycleTime& time, const hal::Sample& pv,
              const control::ControllerOutput& out, std::uint64_t missed) noexcept;
  void report(const hal::Sample& pv, std::uint64_t missed) noexcept;
  void event(EventCode code, std::uint8_t a, std::uint8_t b, double value) noexcept;

  std::uint32_t loop_;
  LoopSettings settings_;
  LoopSettings configured_;  // the same, with jacket and compensator as their file has them
  SettingsOffer offer_;
  bool offer_waits_ = false;
  std::optional<JacketWish> jacket_since_offer_;  // the newest order for it since the offer came
  StartSettings start_;
  ValvePositionSource valve_source_;
  plant::EffectChain valve_model_;
  hal::LoopIo& io_;
  LoopChannels& channels_;
  base::SpscRing<Event>& events_;

  PvGuard pv_guard_;
  control::Supervisor supervisor_;
  control::LoopController controller_;
  hal::Inputs inputs_;
  std::int64_t now_ns_ = 0;
  bool output_known_ = false;  // where the valve stands is known
  bool ever_known_ = false;    // it has been at some time
  bool told_ = false;          // by the operator, since it was lost last
  bool was_lost_ =
      false;  // commands did not reach the valve, or the process paused, in the cycle before
  bool ever_written_ = false;  // a command has gone out
  std::int64_t unknown_since_ns_ = 0;
  bool withheld_ = false;  // no command goes out in this cycle
  bool known_before_withheld_ = false;
  bool was_not_finite_ = false;  // result of the cycle before
  double modelled_valve_ = 0.0;  // CO units
  control::Fault reported_fault_ = control::Fault::starting;
  control::Mode reported_mode_ = control::Mode::fallback;
  bool reported_standing_back_ = false;
  bool reported_disengaged_ = false;
};

}  // namespace loopwarden::daemon::rt
