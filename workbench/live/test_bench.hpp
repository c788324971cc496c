// SPDX-License-Identifier: Apache-2.0
// A loop in manual whose output a test moves: a simulated loop or a loop of a running daemon.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/protocol/planned_test/test_session.hpp"
#include "model/plant/plant.hpp"
#include "workbench/live/daemon_client.hpp"

namespace loopwarden::workbench {

// The test must end now, for the reason in the text. ~LiveBench restores the output.
class TestAborted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct BenchRow {
  double time_s = 0.0;  // of the loop
  double co = 0.0;      // CO units
  double pv = 0.0;      // PV units
  double stem = 0.0;    // CO units; NaN: no read-back
};

class TestBench {
 public:
  TestBench() = default;
  TestBench(const TestBench&) = delete;
  TestBench& operator=(const TestBench&) = delete;
  virtual ~TestBench() = default;

  // Holds `co` for `seconds` of the loop's time and returns the rows of that time. Throws
  // TestAborted.
  virtual std::vector<BenchRow> hold(double co, double seconds) = 0;
  virtual double sample_time_s() const = 0;
  virtual double output() const = 0;            // CO units, at the start of the test
  virtual double process_variable() const = 0;  // PV units, at the start of the test
  virtual double output_low() const = 0;
  virtual double output_high() const = 0;
  virtual control::Action action() const = 0;  // of the controller
};

class SimulatedBench : public TestBench {
 public:
  explicit SimulatedBench(const plant::LoopModel& model);
  std::vector<BenchRow> hold(double co, double seconds) override;
  double sample_time_s() const override { return sample_time_s_; }
  double output() const override { return start_; }
  double process_variable() const override { return start_pv_; }
  double output_low() const override { return low_; }
  double output_high() const override { return high_; }
  control::Action action() const override { return action_; }

 private:
  plant::Plant plant_;
  control::Action action_;
  double sample_time_s_;
  double low_;
  double high_;
  double start_;
  double start_pv_;
};

struct LiveLimits {
  double co_low, co_high;  // CO units
  double pv_low, pv_high;  // PV units; the test ends outside of them
  // The commissioning session that holds the loop; otherwise the bench begins a test of the daemon.
  std::optional<std::uint64_t> session{};
  // Called repeatedly during the test. A text ends the test with that reason; empty: continue.
  std::function<std::string()> watch{};
  // Called if the loop could not be restored.
  std::function<void()> not_put_back{};
};

// Takes the loop to manual, in a test of the daemon. However the test ends, the daemon restores
// output, mode and set point, also 60 s after kill -9 of the workbench. If somebody else takes the
// loop to manual, it stays there.
//
// In a commissioning session the destructor restores the loop, unless somebody else took it out of
// manual; after kill -9 the daemon takes the stop action.
class LiveBench : public TestBench {
 public:
  // Throws TestAborted if the loop is not fit for a test or its file is not in force,
  // std::runtime_error from the daemon.
  LiveBench(const std::string& socket, std::string loop, const LiveLimits& limits);
  ~LiveBench() override;

  std::vector<BenchRow> hold(double co, double seconds) override;
  double sample_time_s() const override { return sample_time_s_; }
  double output() const override { return start_; }
  double process_variable() const override { return start_pv_; }
  double output_low() const override { return range_low_; }
  double output_high() const override { return range_high_; }
  control::Action action() const override { return action_; }

 private:
  protocol::LoopStatus status();
  control::Action action_in_force();
  // Waits until the loop takes our command for manual. Returns false if it did not in time.
  bool order_taken();
  protocol::TestTerms terms() const;
  void look_after_loop();
  void in_test(const std::function<void()>& request);
  void move(double co);  // throws TestAborted
  void end_test();
  void order(protocol::SetRequest request);
  void order_output(double co);  // throws TestAborted
  bool out_of_manual();
  // Returns false if somebody else controls the loop now.
  bool restore();
  void put_back() noexcept;  // calls restore() and reports a failure

  DaemonClient daemon_;
  std::string loop_;
  LiveLimits limits_;
  std::optional<protocol::TestSession> test_;  // without a session in the limits
  double sample_time_s_ = 0.1;
  double accelerate_ = 1.0;
  control::Action action_ = control::Action::reverse;
  double range_low_ = 0.0;
  double range_high_ = 100.0;
  double start_ = 0.0;
  double start_pv_ = 0.0;
  double start_sp_ = 0.0;
  bool was_automatic_ = false;
  bool taken_ = false;      // in manual by us, or commanded to manual
  bool in_manual_ = false;  // the loop's status confirmed manual
  bool given_up_ = false;   // somebody else took it
  double last_sent_ = 0.0;
  bool sent_ = false;
  std::uint64_t next_period_ = 0;  // first period that was not read yet
  std::uint64_t due_period_ = 0;   // end of the present hold
};

}  // namespace loopwarden::workbench
