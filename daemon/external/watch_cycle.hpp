// SPDX-License-Identifier: Apache-2.0
// One period of a loop that another controller runs: from the newest that its source has to a row for recorder and
// monitor, the same that a loop controlled here leaves.
//
// It is no part of the real-time path and never runs on its thread: nothing waits for its result and nothing is
// written, so a period that comes late costs a row and moves no valve; and a thousand watched loops take nothing of the
// time in which loops are controlled. All of them share one ordinary thread (sampler.hpp), which is also the one reader
// that their sources allow.
//
//   age       of a value: since its time, or since its source's newest sign of life, whichever is less. Within max_age it
//             counts; PV older than max_age by its own time alone is `held`: the source sends on change
//   PV        checked as that of a loop controlled here; quality from the source, made worse by the checks
//   SP, CO,   not a number while not known, out of range (pv_guard.hpp), or not wired (SP, stem)
//   stem
//   mode      automatic or manual by the numbers of the loop's file, else, and while it is not known, fallback; automatic
//             where none is wired
//   fault     `bad PV` while PV is bad or frozen; otherwise `output unknown` while CO is not known;
//             otherwise none
//
// What it can't do: know what happened between two periods.
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

// What of a source is wired besides PV and CO.
struct Wiring {
  bool set_point = false;
  bool stem = false;
  bool mode = false;
  hal::ModeValues mode_values{};
};

class WatchCycle {
 public:
  // Everything referred to outlives this. `loop`: its index, for events.
  WatchCycle(std::uint32_t loop, const rt::LoopSettings& settings, Wiring wiring,
             hal::LoopSource& source, rt::LoopChannels& channels,
             base::SpscRing<rt::Event>& events);

  // `missed`: periods skipped since the last call.
  void run(const hal::CycleTime& time, std::uint64_t missed) noexcept;

 private:
  void take_settings() noexcept;
  hal::Sample checked_pv(const hal::SourceSample& pv, double co, control::Mode mode) noexcept;
  // Bad if it is too old.
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
