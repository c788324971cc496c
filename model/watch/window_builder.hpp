// SPDX-License-Identifier: Apache-2.0
// Turns the cycles of one loop into windows of alarm::kWindowSamples samples, stepped by the caller.
//
// `decimation` cycles are averaged into one sample, so that a loop at 100 Hz sees as far back as one at
// 10 Hz. A window follows the one before by (1 - overlap) of its length. A window never reaches across
// a change of mode, a PV that is not good, or a gap in the cycles that is longer than a moment: what was
// gathered is then thrown away and gathering begins again. A set-point change is no reason: signatures
// begin with one.
//
// A gap of at most kLongestBridge samples is bridged, as long as no window has more than kMostBridged
// samples so made: PV and stem on the straight line between their neighbours, SP and CO as they stood,
// which is what the output of a loop that comes late does. Window::bridged_cycles counts them.
//
// Errors: settings outside their ranges are brought to the nearest that is within.
// What it can't do: know what happened in a cycle that is missing. A loop that misses more is not judged,
// which shows as `gap`.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "model/alarm/window.hpp"

namespace loopwarden::watch {

// In samples, that is in cycles times decimation: 0.4 s of 96 s, and 1 % of a window.
inline constexpr std::size_t kLongestBridge = 4;
inline constexpr std::size_t kMostBridged = 9;

// One cycle of a loop, as the monitor sees it.
struct Cycle {
  std::uint64_t period_index = 0;  // periods since the start; a gap shows as a jump
  double sp = 0.0;                 // PV units
  double pv = 0.0;                 // PV units
  double co = 0.0;                 // CO units
  double stem = 0.0;               // CO units; NaN if there is none
  bool automatic = false;
  bool pv_good = false;
};

struct WindowSettings {
  double overlap = 0.5;        // 0 to 0.95, share of a window that the next one has in common
  std::size_t decimation = 1;  // 1 to 10000 cycles to a sample
  double sample_time_s = 0.1;  // s, of a cycle
  double pv_low = 0.0;         // PV units
  double pv_high = 100.0;
  double co_low = 0.0;  // CO units
  double co_high = 100.0;
  bool routine = true;        // routine evidence is weighed, see routine_watch.hpp
  bool has_set_point = true;  // false: nobody knows SP, and there are no windows
  // A source may report a value only when it has changed by more than a dead band: a loop that another controller runs.
  bool on_change = false;
};

class WindowBuilder {
 public:
  explicit WindowBuilder(const WindowSettings& settings);

  enum class Progress : std::uint8_t {
    none,
    broken,  // what was gathered is lost; state() says why. Once for each stretch that can't be used
    full     // window() holds a window until the next call of add()
  };
  // No allocation.
  Progress add(const Cycle& cycle) noexcept;

  // Of the newest window; while the first one of a stretch is being gathered, filling or gap.
  alarm::WindowState state() const noexcept { return state_; }
  alarm::Window window() const noexcept;
  const WindowSettings& settings() const noexcept { return settings_; }
  // Number of the newest cycle; of the last in the window, unless that one was made up.
  std::uint64_t last_period() const noexcept { return last_period_; }
  double filled() const noexcept;  // share of the next window that is there, 0 to 1

 private:
  alarm::WindowState usable(const Cycle& cycle) const noexcept;
  void start_over() noexcept;
  // Whether `missing` cycles before this one may be made up for; does so.
  bool bridge(const Cycle& cycle, std::uint64_t missing) noexcept;
  // Of the last samples that a window has; the present sample's included.
  std::size_t bridged_in_window() const noexcept;
  void append(const Cycle& cycle, bool made_up) noexcept;
  void put_in_order() noexcept;

  WindowSettings settings_;
  std::ptrdiff_t advance_;  // samples from one window to the next
  // Rings of a window's length, with the oldest sample at first_; put in order where a window is full.
  struct Columns {
    std::vector<double> sp, pv, co, stem;
  };
  Columns columns_;
  std::vector<std::uint16_t> bridged_;  // of each sample, cycles that were made up
  Cycle last_;                          // the newest that was gathered
  std::size_t first_ = 0;
  std::size_t count_ = 0;  // samples that are there
  // Samples until a window is full; below 0 while a bridge goes beyond its end.
  std::ptrdiff_t until_next_ = 0;
  std::size_t in_sample_ = 0;  // cycles in the sums below
  double sum_sp_ = 0.0;
  double sum_pv_ = 0.0;
  double sum_co_ = 0.0;
  double sum_stem_ = 0.0;
  std::uint16_t bridged_in_sample_ = 0;
  std::uint64_t last_period_ = 0;
  bool any_ = false;    // a cycle has been seen
  bool broken_ = true;  // the stretch before this cycle could not be used
  bool window_in_stretch_ = false;
  alarm::WindowState state_ = alarm::WindowState::filling;
};

}  // namespace loopwarden::watch
