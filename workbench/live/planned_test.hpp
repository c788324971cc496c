// SPDX-License-Identifier: Apache-2.0
// Carries out the test of a plan: on a simulated loop, or on a loop of the running daemon, which
// checks each move, watches the loop and restores it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "daemon/protocol/answers.hpp"
#include "model/plant/loop_model.hpp"
#include "workbench/files/test_plan_file.hpp"
#include "workbench/live/daemon_client.hpp"

namespace loopwarden::workbench {

// Columns of equal length, with the time before the first move.
struct TestRecord {
  double period_s = 0.1;
  std::vector<double> time_s;  // 0 at the first move
  std::vector<double> sp, pv;  // PV units
  std::vector<double> co;      // CO units
  std::vector<double> stem;    // CO units; NaN: no read-back
};

// Throws effects::EffectError for a model that can't be simulated.
TestRecord simulate_test(const plant::LoopModel& model, const TestPlanFile& plan);

// Returns why the plan does not fit the loop at present; empty: it does. `from`: SP or output from
// which it would move. Throws DaemonError.
std::string why_no_test(DaemonClient& daemon, const protocol::LoopStatus& loop,
                        const TestPlanFile& plan);
// Returns the daemon's status of a loop. Throws std::runtime_error if there is no such loop.
protocol::LoopStatus loop_of_daemon(DaemonClient& daemon, const std::string& tag);

struct CarriedOut {
  TestRecord record;
  std::string ended_early;  // the reason; empty: to its end
  bool restored = false;    // the daemon has released the loop
};

// `watch` is called often with the time since the first move and the newest values; a text ends the
// test with this reason. If this process dies, the daemon restores the loop within 60 s.
struct TestProgress {
  double time_s, sp, pv, co;
};
CarriedOut carry_out(DaemonClient& daemon, const TestPlanFile& plan,
                     const std::function<std::string(const TestProgress&)>& watch);

}  // namespace loopwarden::workbench
