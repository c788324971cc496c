// SPDX-License-Identifier: Apache-2.0
#include "daemon/protocol/planned_test/test_session.hpp"

#include <exception>
#include <stdexcept>
#include <thread>
#include <utility>

#include "daemon/protocol/ask.hpp"

namespace loopwarden::protocol {

using std::chrono::steady_clock;

// The daemon refuses the begin while its newest command is not on the disk.
TestSession::TestSession(Daemon& daemon, std::string loop, const TestTerms& terms,
                         const Person& person)
    : daemon_(daemon), loop_(std::move(loop)), person_(person) {
  const auto until = steady_clock::now() + std::chrono::seconds(5);
  CommissioningRequest begin = request();
  begin.test = terms;
  while (session_ == 0) {
    try {
      session_ = ask(daemon_, begin).session;
    } catch (const DaemonError& e) {
      if (e.kind() != DaemonError::Kind::not_yet || steady_clock::now() > until) throw;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  }
  told_ = steady_clock::now();
}

TestSession::~TestSession() {
  try {
    end();
  } catch (const std::exception&) {  // the daemon ends it without a sign of life
  }
}

CommissioningRequest TestSession::request() const {
  CommissioningRequest request{.loop = loop_, .user = person_.user, .address = person_.address};
  if (session_ != 0) request.session = session_;
  return request;
}

bool TestSession::move(double to) {
  CommissioningRequest move = request();
  move.move = to;
  try {
    ask(daemon_, move);
  } catch (const DaemonError& e) {
    if (e.kind() != DaemonError::Kind::not_yet) throw;
    return false;
  }
  told_ = steady_clock::now();
  return true;
}

void TestSession::alive() {
  constexpr std::chrono::seconds kBetween{5};
  if (steady_clock::now() - told_ < kBetween) return;
  ask(daemon_, request());
  told_ = steady_clock::now();
}

void TestSession::end(const std::string& why) {
  if (session_ == 0) return;
  CommissioningRequest end = request();
  end.end = true;
  if (!why.empty()) end.why = why;
  session_ = 0;
  ask(daemon_, end);
}

LoopStatus loop_of_daemon(Daemon& daemon, const std::string& tag) {
  Status all = ask(daemon, StatusRequest{});
  for (LoopStatus& loop : all.loops) {
    if (loop.name == tag) return std::move(loop);
  }
  throw std::runtime_error("the daemon has no loop '" + tag + "'");
}

bool wait_released(Daemon& daemon, const std::string& tag, const std::function<bool()>& leave) {
  const auto until = steady_clock::now() + std::chrono::seconds(45);
  while (steady_clock::now() < until && !leave()) {
    if (!loop_of_daemon(daemon, tag).commissioning) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return false;
}

}  // namespace loopwarden::protocol
