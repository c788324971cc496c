// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "base/spsc_ring.hpp"
#include "daemon/rt/event.hpp"
#include "daemon/rt/loop_channels.hpp"
#include "daemon/rt/loop_settings.hpp"
#include "daemon/rt/command.hpp"
#include "daemon/rt/output_knowledge.hpp"
#include "daemon/rt/pv_guard.hpp"
#include "hal/contract/loop_io.hpp"
#include "model/control/loop_controller.hpp"
#include "model/control/supervisor.hpp"
#include "model/effects/effect.hpp"

namespace loopwarden::daemon::rt {

// Configured state of a loop at the start of the daemon.
struct StartSettings {
  control::Mode mode = control::Mode::manual;
  double set_point = 0.0;  // PV units
  // Used if no read-back gives the position. hold: the position is unknown until an operator sets
  // an output.
  control::OutputAction output;
};

// Source of the valve position for the jacket.
enum class ValvePositionSource : std::uint8_t { none, read_back, model };

// Steps one loop: from the newest sample to the newest command. The threads of the backends
// exchange both with the devices.
class ControlCycle {
 public:
  // `events` is shared by all loops of the real-time thread. All references outlive this object.
  ControlCycle(std::uint32_t loop, double period_s, const LoopSettings& settings,
               const StartSettings& start, ValvePositionSource valve_source,
               effects::EffectChain valve_model, hal::LoopIo& io, LoopChannels& channels,
               base::SpscRing<Event>& events);

  // Runs one period on the real-time thread. `missed`: periods skipped since the last call;
  // `stop`: the daemon is ending.
  void run(const hal::CycleTime& time, std::uint64_t missed, bool stop) noexcept;

 private:
  void take_settings() noexcept;
  void publish_in_force() noexcept;
  void take_commands() noexcept;
  void answer(CommandMailbox& box) noexcept;
  Refusal take(const Command& command, const InForce& now) noexcept;
  InForce in_force() const noexcept;
  void apply(const Command& command) noexcept;
  void apply(JacketMode mode) noexcept;
  void apply(MovesMode mode) noexcept;
  LoopAvailability availability() const noexcept;
  void publish_availability() noexcept;
  void read(const hal::CycleTime& time) noexcept;
  hal::Sample checked_pv() noexcept;
  control::Conditions conditions(const hal::Sample& pv, std::uint64_t missed,
                                 bool stop) const noexcept;
  bool read_back_good() const noexcept;
  void find_output(const control::Conditions& found, const control::Decision& decision) noexcept;
  void assume_output(double output) noexcept;
  double known_output() const noexcept;  // CO units; NaN: unknown
  control::ControllerOutput decide(const control::Decision& decision,
                                   const hal::Sample& pv) noexcept;
  hal::Command checked(const control::ControllerOutput& out, const control::Decision& decision,
                       double output_before) noexcept;
  void write(const hal::CycleTime& time, const hal::Command& command) noexcept;
  void report_stop(const control::ControllerOutput& out,
                   const control::Decision& decision) noexcept;
  void record(const hal::CycleTime& time, const hal::Sample& pv,
              const control::ControllerOutput& out, std::uint64_t missed) noexcept;
  void send_moves_sample() noexcept;
  void report(const hal::Sample& pv, std::uint64_t missed) noexcept;
  void event(EventCode code, std::uint8_t a, std::uint8_t b, double value) noexcept;

  std::uint32_t loop_;
  LoopSettings settings_;
  LoopSettings configured_;  // `settings_` with jacket and compensator of the file
  SettingsOffer offer_;
  bool offer_waits_ = false;
  std::optional<JacketMode> jacket_since_offer_;  // newest command for the jacket after the offer
  ValvePositionSource valve_source_;
  effects::EffectChain valve_model_;
  hal::LoopIo& io_;
  LoopChannels& channels_;
  base::SpscRing<Event>& events_;

  PvGuard pv_guard_;
  control::Supervisor supervisor_;
  control::LoopController controller_;
  OutputKnowledge output_;
  hal::Inputs inputs_;
  std::int64_t now_ns_ = 0;
  double modelled_valve_ = 0.0;  // CO units
  // State that the newest events reported.
  control::Fault reported_fault_ = control::Fault::starting;
  control::Mode reported_mode_ = control::Mode::fallback;
  bool reported_standing_back_ = false;
  control::DisengageReason reported_disengaged_ = control::DisengageReason::none;
};

}  // namespace loopwarden::daemon::rt
