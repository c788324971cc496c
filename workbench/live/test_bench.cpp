// SPDX-License-Identifier: Apache-2.0
#include "workbench/live/test_bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <thread>
#include <utility>

#include "daemon/protocol/ask.hpp"
#include "daemon/protocol/planned_test/in_force.hpp"
#include "workbench/live/terminal.hpp"

namespace loopwarden::workbench {
namespace {

// Returns the requested mode of the newest cycle; empty before the first one.
std::string requested_mode(const protocol::LoopStatus& loop) {
  return loop.cycle ? loop.cycle->requested_mode : std::string();
}

bool has_fault(const protocol::LoopStatus& loop) {
  return loop.cycle && loop.cycle->fault != "none";
}

// Prints to standard error. Does not throw if the terminal is gone.
void say(const std::string& text) { std::fputs(text.c_str(), stderr); }

}  // namespace

SimulatedBench::SimulatedBench(const plant::LoopModel& model)
    : plant_(model, model.scenario.seed),
      action_(model.controller.pid.action),
      sample_time_s_(model.sample_time_s),
      low_(model.controller.pid.output_low),
      high_(model.controller.pid.output_high),
      start_(model.scenario.set_point.empty()
                 ? (low_ + high_) / 2.0
                 : plant_.output_for(model.scenario.set_point.front().second)) {
  plant_.reset(start_);
  start_pv_ = plant_.process_variable();
}

std::vector<BenchRow> SimulatedBench::hold(double co, double seconds) {
  std::vector<BenchRow> rows;
  const auto samples = std::max(1L, std::lround(seconds / sample_time_s_));
  for (long k = 0; k < samples; ++k) {
    plant_.step(co);
    rows.push_back({plant_.time_s(), co, plant_.process_variable(), plant_.stem()});
  }
  return rows;
}

LiveBench::LiveBench(const std::string& socket, std::string loop, const LiveLimits& limits)
    : daemon_(socket), loop_(std::move(loop)), limits_(limits) {
  const protocol::Remedies remedies{
      .reload = fmt::format("Run `loopwarden reload{}`.", socket_option(socket))};
  if (const std::string why = protocol::not_in_force(daemon_, loop_, {}, remedies); !why.empty())
    throw TestAborted(why);
  const protocol::LoopStatus before = status();
  const protocol::Cycle cycle = before.cycle.value_or(protocol::Cycle{.fault = "?"});
  sample_time_s_ = before.sample_time_s;
  action_ = action_in_force();
  range_low_ = before.co_range[0];
  range_high_ = before.co_range[1];
  start_ = cycle.co;
  start_pv_ = cycle.pv;
  start_sp_ = cycle.sp;
  was_automatic_ = cycle.requested_mode == "AUTO";
  if (cycle.fault != "none" || !std::isfinite(start_) || !std::isfinite(start_pv_)) {
    throw TestAborted(
        fmt::format("{} is not ready for a test: fault {}, CO or PV unknown", loop_, cycle.fault));
  }
  if (start_ < limits_.co_low || start_ > limits_.co_high || start_pv_ < limits_.pv_low ||
      start_pv_ > limits_.pv_high) {
    throw TestAborted(fmt::format("{} is outside the given limits: CO {:.4g}, PV {:.4g}", loop_,
                                  start_, start_pv_));
  }
  watch_interrupts();
  next_period_ = cycle.period + 1;
  due_period_ = next_period_;
  if (!limits_.session) in_test([&] { test_.emplace(daemon_, loop_, terms()); });
  taken_ = true;
  try {
    if (!test_) order({.mode = "man"});
    if (!order_taken()) throw TestAborted(loop_ + " does not go to manual");
  } catch (const std::exception&) {
    // The daemon may have taken the command although its answer was lost. A constructor that throws
    // has no destructor, so the loop is restored here.
    put_back();
    throw;
  }
}

protocol::TestTerms LiveBench::terms() const {
  constexpr double kLongest_s = 8.0 * 3600.0;  // as the daemon's
  return {.pv = {limits_.pv_low, limits_.pv_high},
          .co = {limits_.co_low, limits_.co_high},
          .moved = {limits_.co_low, limits_.co_high},
          .manual = true,
          .any_size = true,
          .longest_s = kLongest_s,
          .plan = fmt::format("output {:.5g} to {:.5g}", limits_.co_low, limits_.co_high)};
}

control::Action LiveBench::action_in_force() {
  for (const auto& loop : protocol::ask(daemon_, protocol::DescribeRequest{}).loops) {
    if (loop.tag != loop_) continue;
    if (loop.control == "elsewhere") {
      throw TestAborted(loop_ + " is controlled elsewhere: it cannot be commanded from here");
    }
    if (loop.action) {
      return *loop.action == "direct" ? control::Action::direct : control::Action::reverse;
    }
  }
  throw TestAborted(loop_ + ": the daemon does not report the action of its controller");
}

bool LiveBench::order_taken() {
  using Clock = std::chrono::steady_clock;
  const auto patience = std::chrono::duration<double>(3.0 * sample_time_s_ / accelerate_ + 5.0);
  const auto deadline = Clock::now() + patience;
  while (requested_mode(status()) != "MAN") {
    if (Clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  in_manual_ = true;
  return true;
}

protocol::LoopStatus LiveBench::status() {
  protocol::Status all = protocol::ask(daemon_, protocol::StatusRequest{});
  accelerate_ = all.daemon.accelerate;
  for (protocol::LoopStatus& loop : all.loops) {
    if (loop.name == loop_) return std::move(loop);
  }
  throw TestAborted("the daemon has no loop '" + loop_ + "'");
}

std::vector<BenchRow> LiveBench::hold(double co, double seconds) {
  const double wanted = std::clamp(co, limits_.co_low, limits_.co_high);
  if (!sent_ || wanted != last_sent_) {
    if (test_) {
      move(wanted);
    } else {
      order_output(wanted);
    }
    last_sent_ = wanted;
    sent_ = true;
  }
  const auto wanted_rows =
      static_cast<std::size_t>(std::max(1L, std::lround(seconds / sample_time_s_)));
  // The daemon hangs if there is no row for three times the expected time plus five seconds.
  const auto patience = std::chrono::duration<double>(3.0 * seconds / accelerate_ + 5.0);
  const auto deadline = std::chrono::steady_clock::now() + patience;
  std::vector<BenchRow> rows;
  // Counts absolute periods, so that a late answer does not stretch the test.
  due_period_ = std::max(due_period_, next_period_) + wanted_rows;
  while (next_period_ < due_period_ || rows.empty()) {
    if (interrupted()) throw TestAborted("interrupted");
    if (const std::string why = limits_.watch ? limits_.watch() : ""; !why.empty()) {
      throw TestAborted(why);
    }
    if (std::chrono::steady_clock::now() > deadline) throw TestAborted("no samples arrive");
    const protocol::Trend fresh =
        protocol::ask(daemon_, protocol::TrendRequest{.loop = loop_, .from = next_period_});
    for (std::size_t i = 0; i < fresh.period.size(); ++i) {
      const BenchRow row{static_cast<double>(fresh.period[i]) * fresh.sample_time_s, fresh.co[i],
                         fresh.pv[i], fresh.stem[i]};
      next_period_ = fresh.period[i] + 1;
      rows.push_back(row);
      if (!(row.pv >= limits_.pv_low && row.pv <= limits_.pv_high)) {
        throw TestAborted(fmt::format("PV {:.4g} is outside of {:g} to {:g}", row.pv,
                                      limits_.pv_low, limits_.pv_high));
      }
    }
    look_after_loop();
    std::this_thread::sleep_for(
        std::chrono::duration<double>(std::clamp(0.5 * sample_time_s_ / accelerate_, 0.005, 0.1)));
  }
  return rows;
}

// Throws TestAborted if the test must not go on.
void LiveBench::look_after_loop() {
  if (test_) {
    in_test([&] { test_->alive(); });
    return;
  }
  const protocol::LoopStatus now = status();
  if (requested_mode(now) != "MAN") {
    given_up_ = true;
    throw TestAborted("another user changed the mode from manual");
  }
  if (has_fault(now)) throw TestAborted("the loop has a fault: " + now.cycle->fault);
}

// A refusal of the daemon ends the test.
void LiveBench::in_test(const std::function<void()>& request) {
  try {
    request();
  } catch (const DaemonRefused& e) {
    throw TestAborted(e.what());
  }
}

void LiveBench::move(double co) {
  using Clock = std::chrono::steady_clock;
  const auto patience = std::chrono::duration<double>(3.0 * sample_time_s_ / accelerate_ + 5.0);
  const auto deadline = Clock::now() + patience;
  bool moved = false;
  while (!moved) {
    in_test([&] { moved = test_->move(co); });
    if (moved) return;
    if (Clock::now() > deadline) throw TestAborted(loop_ + " does not take its output");
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

// The daemon restores the loop, unless somebody took it to manual.
void LiveBench::end_test() {
  try {
    test_->end();
  } catch (const DaemonRefused&) {  // the daemon has ended it
  }
  if (!protocol::wait_released(daemon_, loop_, [] { return false; })) {
    throw std::runtime_error("the daemon has not released it yet. See `loopwarden top`");
  }
  const protocol::LoopStatus now = status();
  const bool restored = requested_mode(now) == (was_automatic_ ? "AUTO" : "MAN");
  say(restored ? fmt::format("{}: output returned to {:.4g}, mode {}\n", loop_, start_,
                             was_automatic_ ? "auto" : "man")
               : fmt::format("{}: taken to manual by another user, unchanged\n", loop_));
}

void LiveBench::order(protocol::SetRequest request) {
  request.loop = loop_;
  if (limits_.session) request.session = *limits_.session;
  daemon_.set(request);
}

void LiveBench::order_output(double co) {
  try {
    order({.output = co});
  } catch (const DaemonRefused& e) {
    given_up_ = out_of_manual();
    throw TestAborted(given_up_ ? "another user changed the mode from manual" : e.what());
  }
}

// Returns whether an output was refused because the loop left manual. The daemon already considers
// commands that are on their way. The status shows them a little later.
bool LiveBench::out_of_manual() {
  using Clock = std::chrono::steady_clock;
  const auto patience = std::chrono::duration<double>(3.0 * sample_time_s_ / accelerate_ + 1.0);
  const auto deadline = Clock::now() + patience;
  for (;;) {
    const protocol::LoopStatus now = status();
    if (requested_mode(now) != "MAN") return true;
    if (has_fault(now) || Clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

bool LiveBench::restore() {
  // A command that is still on its way would take the loop to manual after the restore.
  if (!in_manual_ && !order_taken()) return false;
  if (requested_mode(status()) != "MAN") return false;
  std::string refused;
  try {
    order({.output = start_});
  } catch (const DaemonRefused& e) {
    if (out_of_manual()) return false;
    refused = e.what();  // the action for a fault has the output; the mode is restored anyway
  }
  // In manual the set point may have followed PV.
  if (was_automatic_) order({.set_point = start_sp_, .mode = "auto"});
  if (!refused.empty()) throw DaemonRefused(kExitData, refused);
  return true;
}

LiveBench::~LiveBench() { put_back(); }

void LiveBench::put_back() noexcept {
  if (!taken_ || given_up_) return;
  const char* const mode = was_automatic_ ? "auto" : "man";
  try {
    if (test_) {
      end_test();
    } else if (restore()) {
      say(fmt::format("{}: output returned to {:.4g}, mode {}\n", loop_, start_, mode));
    } else {
      say(fmt::format("{}: no longer in manual, unchanged\n", loop_));
    }
  } catch (const std::exception& e) {
    if (limits_.not_put_back) limits_.not_put_back();
    say(fmt::format("{}: could not be restored (output {:.4g}, mode {}): {}\n", loop_, start_, mode,
                    e.what()));
  }
}

}  // namespace loopwarden::workbench
