// SPDX-License-Identifier: Apache-2.0
// The model's free run from the measured CO, taken apart into what PV depends on linearly:
//
//   PV = offset + K' z + c1 m1 + c2 m2 [+ c3 m3] [+ level]
//        + sum of the solved parameters times their columns
//
//   z       valve, process and transmitter at the model's own gain; K' = 1 there
//   m1, m3  what is left of the state at the first sample: each lag of the process away from rest
//           (m3 only if the process has a second lag)
//   m2      another CO before the first sample, still inside the dead time
//   level   1: PV at CO 0 beyond what the model states (only if the level is fitted)
//   offset  sum of the model's level, disturbances and transmitter effects; a term's lag in the
//           transmitter does not change it
//
// PV at sample k+1 follows from CO held since sample k, through the same effects, process and
// transmitter that the simulator and the daemon step; noise and rounding are left out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "model/effects/catalogue.hpp"
#include "model/gap/record.hpp"
#include "model/effects/effect.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::gap {

using effects::Candidate;

// Effects added to the model, in the order in which they were found.
using Terms = std::vector<const Candidate*>;

// Where a search stands.
struct Point {
  double time_constant_s = 1.0;
  double dead_time_s = 0.0;
  // What a healthy valve is allowed: dynamics of its actuator faster than matters to the loop, and
  // friction of a few thousandths of the span.
  double actuator_damping = 0.5;
  double actuator_frequency = 0.0;            // rad/s, undamped; 0: none
  double friction = 0.0;                      // CO units, as a play
  double start_offset = 0.0;                  // CO units, by which the stem rests below CO at first
  std::vector<std::vector<double>> searched;  // one list a term
};

// Where PV at CO 0 comes from.
enum class Level : std::uint8_t {
  of_model,   // as the model states it; 0 if it does not
  of_record,  // fitted: a constant is solved for, and corrected() adds it to process.level
  of_nobody,  // fitted, and left out of corrected(): CO was replayed, from an unknown constant
};

// The name in the catalogue of a level beside the model's.
inline constexpr const char* kLevelName = "output_bias";

class FreeRun {
 public:
  // `model` without noise. `co` complete. Throws effects::EffectError for a model that can't be
  // stepped.
  FreeRun(plant::LoopModel model, std::vector<double> co, Level level = Level::of_model);

  std::size_t size() const noexcept { return co_.size(); }
  const std::vector<double>& offset() const noexcept { return offset_; }
  const std::vector<double>& output() const noexcept { return co_; }  // CO units
  const plant::LoopModel& model() const noexcept { return model_; }

  // z, m1, m2, m3 and the level if they are fitted, then the columns of each term, for at least the
  // first `samples` samples.
  std::size_t column_count(const Terms& terms) const noexcept;
  // Those before the terms' own.
  std::size_t base_columns() const noexcept { return 1 + past_columns() + (fits_level() ? 1 : 0); }
  // m1, m2 and m3: columns 1 to this.
  std::size_t past_columns() const noexcept {
    return model_.process.second_time_constant_s > 0.0 ? 3 : 2;
  }
  bool fits_level() const noexcept { return level_ != Level::of_model; }
  // The fitted level beyond the model's, PV units; 0 if it is not fitted.
  double fitted_level(const std::vector<double>& solved) const {
    return fits_level() ? solved[base_columns() - 1] : 0.0;
  }
  void columns(const Terms& terms, const Point& point, std::vector<std::vector<double>>& columns,
               std::size_t samples = std::numeric_limits<std::size_t>::max()) const;
  // PV of the model without terms whose columns these are. c1 to c3 are fitted to the samples that
  // still remember the start. They and the level, if it is fitted, are fitted to the first `fitted`
  // samples; so are those of an integrating process, which forgets neither its level nor how far CO
  // was off balance.
  std::vector<double> with_past(const Point& point, const std::vector<std::vector<double>>& columns,
                                const std::vector<double>& pv, const std::vector<bool>& measured,
                                std::size_t fitted) const;
  // Sum of squares of what is left of `pv` (offset taken off) when the record is cut into runs of
  // `run_samples`, each with the stem and the process free to start where they fit best. It changes
  // smoothly where one long run of a sticking stem falls from one sequence of slips into another.
  // From `most` on any number that is no less.
  double short_runs(const Terms& terms, const Point& point, const std::vector<double>& pv,
                    const std::vector<bool>& used, double gain, std::size_t run_samples,
                    double most = std::numeric_limits<double>::infinity()) const;
  // The columns of one linear term alone.
  void linear_columns(const Candidate& candidate, const std::vector<double>& searched,
                      std::vector<std::vector<double>>& columns) const;

  // PV as the transmitter's hold, limits and curve show it, those of the model and of the terms.
  // Not linear, hence no part of the columns.
  bool shows_all(const Terms& terms) const noexcept;  // nothing of these is there
  void show(const Terms& terms, const Point& point, std::vector<double>& pv) const;
  // ... and by how much it changes with the PV of the same moment: 0 where it is hidden.
  std::vector<double> slopes(const Terms& terms, const Point& point, std::vector<double> pv) const;

  // The flow of the model under CO, as it leaves the valve or (block process) the effects behind
  // it; and PV's answer, at the model's own gain, to what `law` makes of it there.
  std::vector<double> flow(const Point& point, effects::Block block) const;
  std::vector<double> answer(const Point& point, effects::Block block, effects::Effect law,
                             const std::vector<double>& flow) const;

  // How far below CO the stem stands at the first sample, CO units.
  double start_offset(const Terms& terms, const Point& point) const;

  // The model with the terms in their places, `solved` as fitted behind K', c1, c2.
  plant::LoopModel corrected(const Terms& terms, const Point& point,
                             const std::vector<double>& solved) const;

 private:
  struct Chains {
    effects::EffectChain valve;
    effects::EffectChain process;
    effects::EffectChain transmitter;  // of the terms alone
    bool with_dead_time;               // the process's own is among them
  };
  Chains chains(const Terms& terms, const Point& point) const;
  plant::ProcessParameters process_at(const Point& point, double gain, bool with_dead_time) const;
  // What the slowest lag of the process keeps over a sample of the state that it began with.
  double kept(const Point& point) const;
  // Into `columns`: m1, m2, m3.
  void fill_past(const Point& point, std::vector<std::vector<double>>& columns) const;
  void pass_transmitter(std::vector<double>& signal) const;
  // Of the effects that act on the reading, or of the others.
  effects::EffectChain transmitter_chain(bool of_reading) const;

  plant::LoopModel model_;
  effects::EffectContext context_;
  std::vector<double> co_;  // CO units
  Level level_;
  std::vector<double> offset_;  // PV units
  effects::EffectChain disturbances_;
  effects::EffectChain transmitter_effects_;
  effects::EffectChain reading_effects_;
  bool plain_transmitter_;
};

}  // namespace loopwarden::gap
