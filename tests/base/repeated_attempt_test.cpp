// SPDX-License-Identifier: Apache-2.0
#include "base/repeated_attempt.hpp"

#include <catch2/catch.hpp>
#include <stdexcept>

namespace repeated_attempt_test {

using loopwarden::base::RepeatedAttempt;

TEST_CASE("an action that fails is repeated after a pause, until it succeeds", "[attempt]") {
  RepeatedAttempt attempt("page.sock");
  RepeatedAttempt::Moment now{};
  now += std::chrono::hours(1);
  int calls = 0;
  bool fails = true;
  const auto act = [&] {
    ++calls;
    if (fails) throw std::runtime_error("no room");
  };
  CHECK_FALSE(attempt.run(act, now));
  CHECK(attempt.problem() == "page.sock: no room");
  CHECK_FALSE(attempt.run(act, now + RepeatedAttempt::kPause - std::chrono::milliseconds(1)));
  CHECK(calls == 1);
  fails = false;
  CHECK(attempt.run(act, now + RepeatedAttempt::kPause));
  CHECK(calls == 2);
  CHECK(attempt.problem().empty());
}

TEST_CASE("a part that is no longer needed has no problem", "[attempt]") {
  RepeatedAttempt attempt("page.sock");
  attempt.run([] { throw std::runtime_error("no room"); });
  attempt.give_up();
  CHECK(attempt.problem().empty());
  CHECK(attempt.run([] {}));
}

}  // namespace repeated_attempt_test
