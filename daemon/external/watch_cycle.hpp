// SPDX-License-Identifier: Apache-2.0
// One period of a loop that another controller runs. It converts the newest values of the source
// into a row for recorder and monitor, as a loop controlled here does.
//
// It is separate from the real-time path and its thread. It has no output, so a late period costs a
// row and moves no valve. A thousand watched loops take no time from the controlled loops. All of
// them share one ordinary thread (sampler.hpp), because their sources allow only one reader.
//
//   age       of a value: the time since its time stamp or since its source's newest sign of life,
//             whichever is less. A value within max_age is valid. PV whose own time is older than
//             max_age is `held`: the source sends on change
//   PV        checked like that of a loop controlled here; quality from the source, lowered by the
//             checks
//   SP, CO,   NaN while unknown, out of range (pv_guard.hpp), or not wired (SP, stem)
//   stem
//   mode      automatic or manual by the numbers in the loop's file; otherwise, and while unknown,
//             fallback; automatic if no mode is wired
//   fault     `bad PV` while PV is bad or frozen; otherwise `output unknown` while CO is unknown;
//             otherwise no fault
//
// Limit: events between two periods are not seen.
#pragma once

#include <cstdint>

#include "base/spsc_ring.hpp"
#include "daemon/rt/control_cycle.hpp"
#include "daemon/rt/event.hpp"
#include "daemon/rt/loop_settings.hpp"
#include "daemon/rt/pv_guard.hpp"
#include "hal/contract/loop_io.hpp"
#include "hal/contract/loop_source.hpp"
#include "model/control/loop_controller.hpp"
#include "model/control/supervisor.hpp"

namespace loopwarden::daemon::external {

// Values of a source that are wired in addition to PV and CO.
struct Wiring {
  bool set_point = false;
  bool stem = false;
  bool mode = false;
  hal::ModeValues mode_values{};
};

class WatchCycle {
 public:
  // All referenced objects must outlive this. `loop`: its index, for events.
  WatchCycle(std::uint32_t loop, const rt::LoopSettings& settings, Wiring wiring,
             hal::LoopSource& source, rt::LoopChannels& channels,
             base::SpscRing<rt::Event>& events);

  // `missed`: periods skipped since the last call.
  void run(const hal::CycleTime& time, std::uint64_t missed) noexcept;

 private:
  void take_settings() noexcept;
  hal::Sample checked_pv(const hal::SourceSample& pv, double co, control::Mode mode) noexcept;
  // Returns the value, marked bad if it is too old.
  hal::Sample fresh(const hal::SourceSample& value) const noexcept;
  hal::Sample as_output(const hal::SourceSample& value) const noexcept;
  double age_ns(const hal::SourceSample& value) const noexcept;
  control::Mode mode_now() const noexcept;
  void report(control::Fault fault, hal::Reason reason, control::Mode mode, double co) noexcept;
  void event(rt::EventCode code, std::uint8_t a, std::uint8_t b, double value) noexcept;

  std::uint32_t loop_;
  rt::LoopSettings settings_;
  Wiring wiring_;
  hal::LoopSource& source_;
  rt::LoopChannels& channels_;
  base::SpscRing<rt::Event>& events_;

  rt::PvGuard pv_guard_;
  rt::SettingsOffer offer_;
  hal::SourceInputs inputs_;
  std::int64_t now_ns_ = 0;
  control::Mode last_mode_ = control::Mode::manual;  // the newest of automatic and manual
  control::Fault reported_fault_ = control::Fault::none;
  control::Mode reported_mode_ = control::Mode::fallback;
};

}  // namespace loopwarden::daemon::external
