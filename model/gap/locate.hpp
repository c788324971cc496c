// SPDX-License-Identifier: Apache-2.0
// Where simulation and record disagree: the energy of the difference shared out over blocks,
// stretches of time, and conditions that an engineer can act on. Each sample belongs to one
// condition, so that the shares add up; a pattern in time (a drift, a level from one moment on, a
// period) that explains most of the difference stands before them with what it explains.
//
//   energy of sample k = (pv - pv_before)^2;   share = its part of the sum over the record
//
// Conditions are judged on CO a dead time before, over the time constant. By block the controller's
// energy counts beside that of PV, both relative to their spans.
//
// What it can't do: say why. A share tells where the gap shows, not what makes it.
#pragma once

#include <vector>

#include "model/gap/result.hpp"

namespace loopwarden::gap {

// An effect that was named, and what it accounts for, in any one unit.
struct LocatedEffect {
  effects::Block block = effects::Block::valve;
  double energy = 0.0;
};

// Columns of equal length; PV may have missing samples.
struct Disagreement {
  const plant::LoopModel& model;
  const std::vector<double>& time_s;
  const std::vector<double>& pv;         // PV units
  const std::vector<double>& pv_before;  // PV units, of the model as given
  const std::vector<double>& co;         // CO units
  double rmse = 0.0;                     // PV units, of pv - pv_before
  double noise_floor_rmse = 0.0;         // PV units
  double controller_rmse = 0.0;  // CO units, of a controller that is not the model's; 0: it is
  const std::vector<LocatedEffect>& effects;
  effects::Block likely = effects::Block::process;  // where nothing was named
};

// What is left of PV: what it looks like.
//
//   a disturbance    a pattern in time explains most of it, or noise and a quiet load do
//   the valve        it stands out after reversals, at rest, at a limit, or at one end of the travel
//   the process      it stands out while CO changes, or it is a constant
//   nothing known    none of these
//
// It is a hint where to look, not a finding: a load that happens to come with the moves of CO looks
// like the valve. Compression is never told from the record alone, the controller only where its
// own CO is not explained and little else is.
struct Leftover {
  const plant::LoopModel& model;
  const std::vector<double>& pv;        // PV units
  const std::vector<double>& pv_after;  // PV units, with all that was named
  const std::vector<double>& co;        // CO units
  bool is_noise = false;                // noise and a quiet load account for it
};
LooksLike looks_like(const Leftover& leftover);

// By block, then by time, then by condition; empty where model and record agree exactly.
std::vector<Located> locate(const Disagreement& disagreement);

}  // namespace loopwarden::gap
