// SPDX-License-Identifier: Apache-2.0
// A hypothesis: the loop model plus up to three effects, and the coordinates of its search.
//
// Each coordinate is a number from 0 to 1:
//
//   of each effect   its searched parameters (effects/candidate.hpp)
//   process          time constant and dead time, if the model doesn't know them
//   healthy valve    damping and frequency of the actuator, friction; if the loop has a valve
//   slips            error of the moment of a jump, if PV jumps with a parameter
//   error            intensity of the disturbance, size of the law's error (error_filter.hpp)
//
// Parameters on which PV depends linearly are no coordinates: likelihood.hpp integrates them out.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "model/estimator/constants.hpp"
#include "model/estimator/law.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::estimator {

using Terms = std::vector<const Law*>;

// The values of all coordinates.
struct Point {
  std::vector<std::vector<double>> searched;  // one list per effect
  std::vector<effects::Schedule> schedules;   // of each effect
  double time_constant_s = 1.0;
  double dead_time_s = 0.0;  // of the process, without the delay of the actuator
  double actuator_damping = 0.5;
  double actuator_frequency = 0.0;  // rad/s; 0: no valve
  double friction = 0.0;            // CO units, of a healthy valve
  double start_offset = 0.0;        // CO units, by which the stem rests below CO at first
  double jitter = 0.0;              // share of a jump
  std::size_t disturbance = 0;      // index in the ErrorGrid
  std::size_t law = 0;
};

// Places in the vector of coordinates.
struct Layout {
  std::size_t own = 0;       // coordinates of the effects: the first ones
  std::size_t process = 0;   // first of two, if wide
  std::size_t actuator = 0;  // first of three, if there is a valve
  std::size_t jitter = 0;    // if it jumps
  std::size_t error = 0;     // first of two
  std::size_t size = 0;
};

// The loop as all hypotheses share it.
struct LoopFacts {
  // `largest_disturbance`: of the PV span per root second.
  explicit LoopFacts(const plant::LoopModel& model, bool level_known = true,
                     double largest_disturbance = kLimits.largest_disturbance);
  plant::LoopModel model;      // without noise, rounding and random disturbance, at its period
  bool wide;                   // time constant and dead time are coordinates
  bool level_free;             // the model does not know PV at CO 0
  double answer_s;             // lags plus dead time
  double pv_span;              // PV units
  double co_span;              // CO units
  double largest_disturbance;  // PV units per root second
  double level_deviation;      // PV units, of the random disturbance that the model states
  effects::SearchRange damping, frequency, friction, time_factor, dead_factor;
};

class Hypothesis {
 public:
  Hypothesis(const LoopFacts& loop, Terms terms);

  const Terms& terms() const noexcept { return terms_; }
  const Layout& layout() const noexcept { return layout_; }
  bool wide() const noexcept { return loop_->wide; }
  bool has_valve() const noexcept { return loop_->model.has_valve; }
  bool jumps() const noexcept { return jumps_ && !by_law_; }
  bool changes_gain() const noexcept;
  // The transmitter bends or clips what it reads, so PV is not linear in any parameter.
  bool bends_reading() const noexcept;
  // Index of the effect whose slips PV can show; npos: none.
  std::size_t sticking() const noexcept { return sticking_; }
  static constexpr std::size_t npos = static_cast<std::size_t>(-1);

  // The same with every slip by its law: without the coordinate of the slips.
  Hypothesis law_only() const;
  // Coordinates of law_only() from those of this hypothesis, and back.
  std::vector<double> without_slips(std::vector<double> z) const;
  std::vector<double> with_law_slips(std::vector<double> z) const;

  Point at(std::span<const double> z) const;
  // Middle of a bin of an error coordinate.
  static double middle(std::size_t bin, std::size_t bins) noexcept {
    return (static_cast<double>(bin) + 0.5) / static_cast<double>(bins);
  }
  // First coordinate of effect `term`.
  std::size_t first_of(std::size_t term) const noexcept;

  // Number of parameters and handicap, nats, of its effects.
  double parameters() const noexcept;
  double handicap() const noexcept;
  std::string title() const;  // "stiction+gain_change", "none"
  bool named() const noexcept;
  std::vector<std::string> names() const;
  bool contains(std::string_view name) const noexcept;

 private:
  const LoopFacts* loop_;
  Terms terms_;
  Layout layout_;
  bool jumps_ = false;
  bool by_law_ = false;
  std::size_t sticking_ = npos;
};

// Whether two effects can be parts of one hypothesis.
bool compatible(const Law& a, const Law& b);

}  // namespace loopwarden::estimator
