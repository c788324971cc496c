// SPDX-License-Identifier: Apache-2.0
// The free run of a hypothesis under the measured CO, as the columns on which PV depends linearly:
//
//   PV = offset + K' z + dT zT + dL zL + level + sum a_i s_i + sum b_i c_i
//
//   z        valve, process and transmitter at the gain of the model; K' is 1 there
//   zT, zL   derivatives of z by ln T and by the dead time
//   s_i      decays of the lags from the state at the first sample; integrating: a ramp
//   c_i      responses of PV to the solved parameters of the effects
//   offset   level, disturbances and transmitter effects of the model
//
// Valve, process, transmitter and effects are the ones that the simulator and the daemon step
// (model/effects, model/plant); none is defined again here. PV at sample k + 1 follows from CO held
// since sample k. CO before the record is unknown: the first dead time of PV counts for nothing.
#pragma once

#include <span>
#include <vector>

#include "model/effects/effect.hpp"
#include "model/estimator/blocks.hpp"
#include "model/estimator/hypothesis.hpp"
#include "model/estimator/slips.hpp"

namespace loopwarden::estimator {

// Places of the columns.
struct Columns {
  static constexpr std::size_t kGain = 0;
  static constexpr std::size_t kLag = 1;
  static constexpr std::size_t kDeadTime = 2;
  static constexpr std::size_t kFirstFixed = 3;  // level, then the decays
};

class LoopRun {
 public:
  // `loop` must outlive it. Throws effects::EffectError for a model that can't be stepped.
  LoopRun(const LoopFacts& loop, std::vector<double> co);

  std::size_t size() const noexcept { return co_.size(); }
  const std::vector<double>& offset() const noexcept { return offset_; }
  // Level and decays, which are the same for every hypothesis.
  const std::vector<std::vector<double>>& fixed() const noexcept { return fixed_; }

  // Fills in z, zT and zL, of `samples` samples. A sticking stem follows `slips` unless they are
  // null. Returns the penalty of the slips, nats. `stem`, if not null, receives the travel.
  double run(const Hypothesis& hypothesis, const Point& point, std::size_t samples,
             const Slips* slips, std::vector<double> (&columns)[3],
             std::vector<double>* stem) const;
  // The response of PV, at the gain of the model, to a flow that leaves the valve.
  std::vector<double> response(const Hypothesis& hypothesis, const Point& point,
                               std::vector<double> flow) const;
  // The columns of the solved parameters of effect `term`, for a signal of `samples` samples.
  void solved(const Hypothesis& hypothesis, const Point& point, std::size_t term,
              std::size_t samples, std::vector<std::vector<double>>& columns) const;

  // Passes PV of the free run through the effects that bend or clip the reading.
  void read(const Hypothesis& hypothesis, const Point& point, std::vector<double>& pv) const;

  // The model with the effects in their places. `linear`: K' - 1, ln T, dead time and level, in the
  // order of Columns. `solved`: one list per effect.
  plant::LoopModel corrected(const Hypothesis& hypothesis, const Point& point,
                             std::span<const double> linear,
                             const std::vector<std::vector<double>>& solved) const;

 private:
  struct Placed {
    effects::EffectSpec spec;
    effects::Schedule schedule;
  };
  static std::vector<Placed> always(const std::vector<effects::EffectSpec>& specs);
  static effects::EffectChain chain_of(std::span<const Placed> placed,
                                       const effects::EffectContext& context);
  static void place_in_valve(std::vector<Placed>& valve, Placed placed);
  static void add_healthy_valve(std::vector<Placed>& valve, const Point& point);
  std::vector<Placed> valve_of(const Hypothesis& hypothesis, const Point& point) const;
  void pass_transmitter(std::span<double> signal) const;
  std::size_t sample_at(double time_s) const noexcept;
  void show(const effects::EffectChain& chain, std::vector<double> (&columns)[3]) const;
  // Effects between valve and PV, of the model and of the hypothesis.
  struct Behind {
    effects::EffectChain process;
    plant::ProcessParameters parameters;
    effects::EffectChain transmitter;  // of the hypothesis only
  };
  Behind behind(const Hypothesis& hypothesis, const Point& point) const;
  effects::EffectContext context_at(const Point& point) const;

  const LoopFacts& loop_;
  effects::EffectContext context_;
  std::vector<double> co_;      // CO units
  std::vector<double> offset_;  // PV units
  std::vector<std::vector<double>> fixed_;
  effects::EffectChain disturbances_;
  effects::EffectChain transmitter_;
  bool plain_;  // no disturbance and no effect of the transmitter
};

}  // namespace loopwarden::estimator
