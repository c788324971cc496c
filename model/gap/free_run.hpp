// SPDX-License-Identifier: Apache-2.0
// The model's free run from the measured CO, taken apart into what PV depends on linearly:
//
//   PV = offset + K' z + c1 m1 + c2 m2 + sum of the solved parameters times their columns
//
//   z       valve, process and transmitter at the model's own gain; K' = 1 there
//   m1, m2  what is left of the unknown past: the process away from rest at the first sample, and
//           another CO before it, still inside the dead time
//   offset  what the model's own disturbances and transmitter effects add; a term's lag in the transmitter leaves it as it is
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
#include "model/plant/effect.hpp"

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

// What says where PV stands at a given CO.
enum class Level : std::uint8_t {
  of_model,
  of_record,  // the model does not know: a constant is solved for, and corrected() has it as output_bias
  of_nobody,  // CO was not measured but replayed, from a constant that nobody knows: solved for, and left out again
};

class FreeRun {
 public:
  // `model` without noise. `co` complete. Throws effects::EffectError for a model that can't be stepped.
  FreeRun(plant::LoopModel model, std::vector<double> co, Level level = Level::of_model);

  std::size_t size() const noexcept { return co_.size(); }
  const std::vector<double>& offset() const noexcept { return offset_; }
  const std::vector<double>& output() const noexcept { return co_; }  // CO units
  const plant::LoopModel& model() const noexcept { return model_; }

  // z, m1, m2, the level where the model does not say it, then the columns of each term, for at least the first `samples` samples.
  std::size_t column_count(const Terms& terms) const noexcept;
  // Those before the terms' own.
  std::size_t base_columns() const noexcept { return level_ == Level::of_model ? 3 : 4; }
  void columns(const Terms& terms, const Point& point, std::vector<std::vector<double>>& columns,
               std::size_t samples = std::numeric_limits<std::size_t>::max()) const;
  // c1, c2 of a model without terms whose columns these are, from the samples that still remember the start; of an
  // integrating process, which forgets neither its level nor how far CO was off balance, from the first `fitted`.
  std::array<double, 2> past(const Point& point, const std::vector<std::vector<double>>& columns,
                             const std::vector<double>& pv, const std::vector<bool>& measured,
                             std::size_t fitted) const;
  // Sum of squares of what is left of `pv` (offset taken off) when the record is cut into runs of
  // `run_samples`, each with the stem and the process free to start where they fit best. It changes
  // smoothly where one long run of a sticking stem falls from one sequence of slips into another. From `most` on any
  // number that is no less.
  double short_runs(const Terms& terms, const Point& point, const std::vector<double>& pv,
                    const std::vector<bool>& used, double gain, std::size_t run_samples,
                    double most = std::numeric_limits<double>::infinity()) const;
  // The columns of one linear term alone.
  void linear_columns(const Candidate& candidate, const std::vector<double>& searched,
                      std::vector<std::vector<double>>& columns) const;

  // PV as the transmitter's hold, limits and curve show it, those of the model and of the terms. Not linear, hence no
  // part of the columns.
  bool shows_all(const Terms& terms) const noexcept;  // nothing of these is there
  void show(const Terms& terms, const Point& point, std::vector<double>& pv) const;
  // ... and by how much it changes with the PV of the same moment: 0 where it is hidden.
  std::vector<double> slopes(const Terms& terms, const Point& point, std::vector<double> pv) const;

  // The flow of the model under CO, as it leaves the valve or (block process) the effects behind it; and PV's answer,
  // at the model's own gain, to what `law` makes of it there.
  std::vector<double> flow(const Point& point, plant::Block block) const;
  std::vector<double> answer(const Point& point, plant::Block block, plant::Effect law,
                             const std::vector<double>& flow) const;

  // How far below CO the stem stands at the first sample, CO units.
  double start_offset(const Terms& terms, const Point& point) const;

  // The model with the terms in their places, `solved` as fitted behind K', c1, c2.
  plant::LoopModel corrected(const Terms& terms, const Point& point,
                             const std::vector<double>& solved) const;

 private:
  struct Chains {
    plant::EffectChain valve;
    plant::EffectChain process;
    plant::EffectChain transmitter;  // of the terms alone
    bool with_dead_time;             // the process's own is among them
  };
  Chains chains(const Terms& terms, const Point& point) const;
  plant::ProcessParameters process_at(const Point& point, double gain, bool with_dead_time) const;
  // What the process keeps over a sample of the state that it began with.
  double kept(const Point& point) const;
  void pass_transmitter(std::vector<double>& signal) const;
  // Of the effects that act on the reading, or of the others.
  plant::EffectChain transmitter_chain(bool of_reading) const;

  plant::LoopModel model_;
  effects::EffectContext context_;
  std::vector<double> co_;  // CO units
  Level level_;
  std::vector<double> offset_;  // PV units
  plant::EffectChain disturbances_;
  plant::EffectChain transmitter_effects_;
  plant::EffectChain reading_effects_;
  bool plain_transmitter_;
};

}  // namespace loopwarden::gap
