// SPDX-License-Identifier: Apache-2.0
#include "services/page/planned_test/test_runner.hpp"

#include <exception>
#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/protocol/ask.hpp"

namespace loopwarden::page::planned_test {
namespace {

using Phase = TestState::Phase;
using protocol::CommissioningRequest;

// Sends requests to the socket that offers them.
class BothSockets final : public protocol::Daemon {
 public:
  BothSockets(Daemon& daemon, Daemon& orders) : daemon_(daemon), orders_(orders) {}

  nlohmann::json ask(const nlohmann::json& request) override {
    const std::string name = request.at("request");
    const bool orders =
        name == CommissioningRequest::kName || name == protocol::TestResultRequest::kName ||
        name == protocol::ReloadRequest::kName || name == protocol::ReloadStateRequest::kName;
    return (orders ? orders_ : daemon_).ask(request);
  }

 private:
  Daemon& daemon_;
  Daemon& orders_;
};

void one_after_the_other(std::size_t count, const std::function<void(std::size_t)>& body) {
  for (std::size_t i = 0; i < count; ++i) body(i);
}

// Judges the test, keeps the decision in the journal, and returns it as a sentence.
std::string judged(const WantedTest& test, const protocol::TestRecord& record,
                   protocol::Daemon& daemon) {
  const protocol::JudgedTest result =
      protocol::judge_test(test.plan, record, test.record, test.model, one_after_the_other);
  const protocol::Decision decision = decision_of(test.plan, result);
  protocol::ask(daemon, protocol::TestResultRequest{.loop = test.plan.loop,
                                                    .explanations = names_of(test.plan),
                                                    .decided = decision.name,
                                                    .predicted = test.plan.probability_right,
                                                    .probability = decision.probability,
                                                    .user = test.person.user,
                                                    .address = test.person.address});
  return sentence_of(test.plan, result);
}

}  // namespace

std::string TestRunner::why_not(const protocol::TestPlanFile& plan) {
  BothSockets daemon(daemon_, orders_);
  return why_no_test(daemon, protocol::loop_of_daemon(daemon, plan.loop), plan);
}

bool TestRunner::start(WantedTest test) {
  constexpr std::size_t kStack = 8UL * 1024UL * 1024UL;
  const std::lock_guard lock(mutex_);
  if (quits_ || (state_ && state_->phase != Phase::over)) return false;
  thread_.join();
  stop_.clear();
  seen_ = clock_();
  state_ = TestState{.loop = test.plan.loop,
                     .by = test.person.user.value_or(""),
                     .duration_s = estimator::duration_s(test.plan.move),
                     .ended_early = {},
                     .sentence = {}};
  thread_.start({.name = "pg-test", .stack_bytes = kStack},
                [this, test = std::move(test)] { run(test); });
  return true;
}

bool TestRunner::stop(const std::string& loop, const std::string& why) {
  const std::lock_guard lock(mutex_);
  if (!state_ || state_->loop != loop || state_->phase != Phase::moving) return false;
  if (stop_.empty()) stop_ = why;
  return true;
}

std::optional<TestState> TestRunner::state(const std::string& loop, bool follows) {
  const std::lock_guard lock(mutex_);
  if (!state_ || state_->loop != loop) return std::nullopt;
  if (follows) seen_ = clock_();
  return state_;
}

bool TestRunner::stop_for(std::chrono::milliseconds patience) {
  {
    const std::lock_guard lock(mutex_);
    quits_ = true;
    if (stop_.empty()) stop_ = "the page ends";
  }
  return thread_.join_for(patience);
}

void TestRunner::change(const std::function<void(TestState&)>& how) {
  const std::lock_guard lock(mutex_);
  how(*state_);
}

// Returns why the test must end; empty: it continues.
std::string TestRunner::watch(const protocol::TestProgress& now) {
  const std::lock_guard lock(mutex_);
  state_->now = now;
  if (stop_.empty() && clock_() - seen_ > kUnseen) {
    stop_ = "the page of the loop was not open for 60 s";
  }
  return stop_;
}

void TestRunner::run(const WantedTest& test) {
  BothSockets daemon(daemon_, orders_);
  const auto quits = [this] {
    const std::lock_guard lock(mutex_);
    return quits_;
  };
  try {
    const protocol::CarriedOut done =
        carry_out(daemon, test.plan, test.person,
                  [this](const protocol::TestProgress& now) { return watch(now); });
    change([&](TestState& s) {
      s.ended_early = done.ended_early;
      s.phase = Phase::restoring;
    });
    const bool restored = protocol::wait_released(daemon, test.plan.loop, quits);
    change([&](TestState& s) {
      s.restored = restored;
      s.phase = Phase::judging;
    });
    if (done.ended_early.empty() && !quits()) {
      std::string sentence = judged(test, done.record, daemon);
      change([&](TestState& s) { s.sentence = std::move(sentence); });
    }
  } catch (const std::exception& e) {
    change(
        [&](TestState& s) { (s.phase == Phase::judging ? s.sentence : s.ended_early) = e.what(); });
  }
  change([](TestState& s) { s.phase = Phase::over; });
}

}  // namespace loopwarden::page::planned_test
