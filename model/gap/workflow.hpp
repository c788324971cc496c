// SPDX-License-Identifier: Apache-2.0
// The gap workflow: where a loop model and a record disagree, which effect the model lacks, and the
// corrected model. From a record and a model to a Result; nothing else goes in but the options.
//
//   check       is the record to be believed; what of it counts         check.hpp, record_check.hpp
//   controller  alone, from SP and PV to CO                             controller.hpp
//   fit         the plant alone, driven by the measured CO              fit_model.hpp, fit.hpp, free_run.hpp
//   search      which effects, added to the model, explain PV           search.hpp, accept.hpp, effects/catalogue.hpp
//   decide      what is missing, how sure, what else it may be          decide.hpp, confidence.hpp
//   prove       on the last third                                       prove.hpp, model_run.hpp
//   locate      where in the loop, when, and under which condition      locate.hpp
//   say         names, parameters, intervals, sentences                 say.hpp
//
// Each stage takes and returns a small struct of its own; the Result is put together at the end.
// Every limit stands in constants.hpp. Without CO the model's controller is replayed on SP and PV,
// and the misfit is that of the closed loop.
//
// What it can't do: effects that come and go during the record, processes of another form than gain
// or integrator, at most two lags and dead time, several loops at once. Then it says `unexplained`.
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

// A model that can't be stepped throws effects::EffectError. A record that can't be used gives a
// result with check.usable false.
Result find_gap(const LoopRecord& record, const plant::LoopModel& model, const Options& options,
                const ParallelFor& parallel, const std::function<void(double)>& progress);

}  // namespace loopwarden::gap
