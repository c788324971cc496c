// SPDX-License-Identifier: Apache-2.0
#include "record/evidence/evidence.hpp"

#include <limits>
#include <utility>

namespace loopwarden::evidence {

using alarm::AlarmReason;

void Evidence::take(const watch::LoopMonitor& monitor, numeric::LoopRecord minutes) {
  const watch::WindowSettings& settings = monitor.settings();
  pv_low = settings.pv_low;
  pv_high = settings.pv_high;
  co_low = settings.co_low;
  co_high = settings.co_high;
  sp = std::move(minutes.sp);
  pv = std::move(minutes.pv);
  co = std::move(minutes.co);
  stem.assign(pv.size(), std::numeric_limits<double>::quiet_NaN());
  sample_time_s = settings.sample_time_s;
  routine.reset();
  by_twin = {monitor.twin()->largest() / monitor.twin()->limit(),
             monitor.controller() != nullptr ? monitor.controller()->score()
                                             : std::numeric_limits<double>::quiet_NaN()};
}

void Evidence::take(const watch::LoopMonitor& monitor, const watch::MonitorStep& step,
                    AlarmReason reason) {
  const auto columns = [this](const auto& samples) {
    sp.assign(samples.sp.begin(), samples.sp.end());
    pv.assign(samples.pv.begin(), samples.pv.end());
    co.assign(samples.co.begin(), samples.co.end());
    sample_time_s = samples.period_s;
  };
  const watch::WindowSettings& settings = monitor.settings();
  pv_low = settings.pv_low;
  pv_high = settings.pv_high;
  co_low = settings.co_low;
  co_high = settings.co_high;
  if (reason == AlarmReason::routine) {
    columns(monitor.routine_samples());
    stem.assign(pv.size(), std::numeric_limits<double>::quiet_NaN());
    routine = step.routine;
    by_twin.reset();
    return;
  }
  const alarm::Window window = monitor.window();
  columns(window);
  stem.assign(window.stem.begin(), window.stem.end());
  routine.reset();
  by_twin.reset();
  measures = step.measures;
  judgement = step.judgement;
}

}  // namespace loopwarden::evidence
