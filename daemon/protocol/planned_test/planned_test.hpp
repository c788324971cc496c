// SPDX-License-Identifier: Apache-2.0
// Carries out the test of a plan: on a simulated loop, or on a loop of the running daemon, which
// checks each move, watches the loop and restores it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "daemon/protocol/answers.hpp"
#include "daemon/protocol/daemon_client.hpp"
#include "daemon/protocol/requests.hpp"
#include "model/plant/loop_model.hpp"
#include "daemon/protocol/planned_test/test_plan_file.hpp"
#include "daemon/protocol/planned_test/test_session.hpp"

namespace loopwarden::protocol {

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
std::string why_no_test(Daemon& daemon, const LoopStatus& loop, const TestPlanFile& plan);

struct CarriedOut {
  TestRecord record;
  std::string ended_early;  // the reason; empty: to its end
};

// `watch` is called often with the time since the first move and the newest values; a text ends the
// test with this reason. If this process dies, the daemon restores the loop after 60 s. `person`:
// who carries it out, on page.sock.
struct TestProgress {
  double time_s, sp, pv, co;
};
CarriedOut carry_out(Daemon& daemon, const TestPlanFile& plan, const Person& person,
                     const std::function<std::string(const TestProgress&)>& watch);

}  // namespace loopwarden::protocol
