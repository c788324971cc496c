// SPDX-License-Identifier: Apache-2.0
// The gap workflow: compares a loop model with a record, names the effect that the model lacks, and
// corrects the model.
//
//   check       quality of the record, counted samples              check.hpp, record_check.hpp
//   controller  compared from SP and PV to CO                       controller.hpp
//   estimate    which effects explain PV under the measured CO      estimator/estimate.hpp
//   prove       share of the gap that is closed on the last third   prove.hpp
//   locate      where in the loop, when, under which condition      locate.hpp
//   say         names, parameters, sentences                        say.hpp
//
// Without CO, the model's controller replayed on SP and PV replaces it, and the errors are those of
// the closed loop. A record with another period than the model (2 to 20 times, longer or shorter)
// is compared at its own period; the controller is then not compared, because its law has the
// period of the model.
//
// Limits: effects that start and end within the record unless they have such a form, processes of
// other forms than a gain or an integrator with up to two lags and dead time, and several loops at
// once. The result is then `unexplained`.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "model/effects/descriptor.hpp"
#include "model/gap/archived.hpp"
#include "model/gap/record.hpp"
#include "model/gap/result.hpp"
#include "model/numeric/parallel.hpp"

namespace loopwarden::gap {

using numeric::ParallelFor;

struct SearchOptions {
  bool several = true;                 // more than one effect
  bool load = true;                    // with an unmeasured disturbance
  std::vector<std::string> without{};  // names that are not given
  bool level_of_record = false;        // the model does not know PV at CO 0
};

struct Options {
  SearchOptions search{};
  // A larger disturbance is unexplained, of the PV span per root second.
  double largest_load = 0.0015;
  std::optional<Deviations> archive{};  // of an archive that kept only a part of the samples
  bool co_in_lines = false;             // the archive connects values of CO by straight lines
};

// A model that can't be stepped throws effects::EffectError. A record that can't be used gives a
// result with check.usable false. `progress` receives the share that is done.
Result find_gap(const LoopRecord& record, const plant::LoopModel& model, const Options& options,
                const ParallelFor& parallel, const std::function<void(double)>& progress);

}  // namespace loopwarden::gap
