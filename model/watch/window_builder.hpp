// SPDX-License-Identifier: Apache-2.0
// Turns the cycles of one loop into windows of alarm::kWindowSamples samples, stepped by the
// caller.
//
// Each sample is the mean of `decimation` cycles, so a loop at 100 Hz has windows of the same
// duration as one at 10 Hz. A window follows the one before by (1 - overlap) of its length. A
// window never includes a change of mode, a PV that is not good, or a long gap in the cycles. Such
// an event discards the collected samples, and collection begins again. A set-point change does
// not, because signatures begin with one.
//
// A gap of at most kLongestBridge samples is bridged, if no window then has more than kMostBridged
// bridged samples. PV and stem are interpolated linearly; SP and CO keep their values, like the
// output of a loop whose cycle is late. Window::bridged_cycles counts the bridged cycles.
//
// Errors: settings outside their ranges are set to the nearest limit.
// Limits: the events of a missing cycle are unknown. A loop with longer gaps is not judged and
// shows `gap`.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "model/alarm/window.hpp"

namespace loopwarden::watch {

// In samples, that is cycles times decimation: 0.4 s of 96 s, and 1 % of a window.

// One cycle of a loop, as input of the monitor.
struct Cycle {
  std::uint64_t period_index = 0;  // periods since the start; a gap shows as a jump
  double sp = 0.0;                 // PV units
  double pv = 0.0;                 // PV units
  double co = 0.0;                 // CO units
  double stem = 0.0;               // CO units; NaN: no read-back
  bool automatic = false;
  bool pv_good = false;
};

struct WindowSettings {
  double overlap = 0.5;        // 0 to 0.95, share of a window that the next one has in common
  std::size_t decimation = 1;  // 1 to 10000 cycles per sample
  double sample_time_s = 0.1;  // s, of a cycle
  double pv_low = 0.0;         // PV units
  double pv_high = 100.0;
  double co_low = 0.0;  // CO units
  double co_high = 100.0;
  bool routine = true;        // use routine evidence, see routine_watch.hpp
  bool has_set_point = true;  // false: SP is unknown, and there are no windows
  // The source may report a value only when it has changed by more than a dead band: a loop that
  // another controller runs.
  bool on_change = false;
};

class WindowBuilder {
 public:
  explicit WindowBuilder(const WindowSettings& settings);

  enum class Progress : std::uint8_t {
    none,
    broken,  // the collected samples are lost; the reason is in state(). Once per unusable stretch
    full     // window() holds a window until the next call of add()
  };
  // Adds a cycle. No allocation.
  Progress add(const Cycle& cycle) noexcept;

  // State of the newest window. While the first one of a stretch is collected: filling or gap.
  alarm::WindowState state() const noexcept { return state_; }
  alarm::Window window() const noexcept;
  const WindowSettings& settings() const noexcept { return settings_; }
  // Number of the newest cycle: the last in the window, unless the last was interpolated.
  std::uint64_t last_period() const noexcept { return last_period_; }
  double filled() const noexcept;  // collected share of the next window, 0 to 1

 private:
  alarm::WindowState usable(const Cycle& cycle) const noexcept;
  void start_over() noexcept;
  // Fills in `missing` cycles before this one, if that is allowed. Returns whether it did.
  bool bridge(const Cycle& cycle, std::uint64_t missing) noexcept;
  // Returns the bridged cycles in the last samples of a window, including the present sample.
  std::size_t bridged_in_window() const noexcept;
  void append(const Cycle& cycle, bool made_up) noexcept;
  void put_in_order() noexcept;

  WindowSettings settings_;
  std::ptrdiff_t advance_;  // samples from one window to the next
  // Rings of a window's length with the oldest sample at first_. They are sorted when a window is
  // full.
  numeric::LoopRecord columns_;
  std::vector<std::uint16_t> bridged_;  // interpolated cycles of each sample
  Cycle last_;                          // the newest collected one
  std::size_t first_ = 0;
  std::size_t count_ = 0;  // valid samples
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
