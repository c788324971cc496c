// SPDX-License-Identifier: Apache-2.0
// The gap workflow: where a loop model and a record disagree, which effect the model lacks, and the
// corrected model. From a record and a model to a Result; nothing else goes in but the options.
//
//   check the record -> controller alone -> plant alone, driven by the measured CO: fit, name, add
//   -> locate -> prove on the last third
//
// Without CO the model's controller is replayed on SP and PV, and the misfit is that of the closed loop.
//
// What it can't do: effects that come and go during the record, processes of another form than gain,
// lag and dead time, several loops at once. Then it says `unexplained`.
#pragma once

#include <functional>

#include "model/gap/record.hpp"
#include "model/gap/result.hpp"
#include "model/gap/search.hpp"

namespace loopwarden::gap {

struct Options {
  SearchOptions search;
  // Loads above this are no quiet wander but something unexplained, of the PV span per root second.
  double largest_load = 0.0015;
};

// A model that can't be stepped throws plant::EffectError. A record that can't be used gives a result
// with check.usable false.
Result find_gap(const Record& record, const plant::LoopModel& model, const Options& options,
                const ParallelFor& parallel, const std::function<void(double)>& progress);

// PV of the model as it stands, driven by `co`; only the unknown state at the start is fitted, a
// stem's place from a grid and, where one is known already, `start_offset` (CO units below CO).
std::vector<double> free_run(const plant::LoopModel& model, const std::vector<double>& co,
                             const std::vector<double>& pv, const std::vector<bool>& used,
                             double start_offset = 0.0);

}  // namespace loopwarden::gap
