// SPDX-License-Identifier: Apache-2.0
#include "daemon/explain/explanation_file.hpp"

#include <catch2/catch.hpp>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace explanation_file_test {

using namespace loopwarden;
using namespace loopwarden::daemon;

namespace {

Explanation read(const std::string& effects, bool agrees) {
  const tests::TemporaryFolder folder;
  replace_text(folder.path() / "explanation.json",
               R"({"alarm": "stiction", "final_name": null, "raised_ms": 1, "ended_ms": 2, )"
               R"("verdict": "missing_effect", "gap_closed": 0.9, "from_s": -60, "sentence": "", )"
               R"("first": null, "agrees": )" +
                   std::string(agrees ? "true" : "false") + R"(, "effects": [)" + effects + "]}");
  return read_explanation(folder.path());
}

}  // namespace

TEST_CASE("s and j of a sticking valve are read if the explanation agrees", "[explain]") {
  const auto gain_but = [](const std::string& alternatives) {
    return R"({"name": "gain_change", "parameters": {"factor": 1.1}, )"
           R"("interval": {}, "confidence": 0.5, )"
           R"("alternatives": [)" +
           alternatives + "]}";
  };
  const std::string gain = gain_but("");
  const std::string sticks = R"({"name": "stiction", "parameters": {"s": 0.9, "j": 0.4}, )"
                             R"("interval": {"s": [0.8, 1.0], "j": [null, null]}, )"
                             R"("confidence": 0.8, "alternatives": []})";
  for (const std::string& effects : {sticks, gain + ", " + sticks}) {
    const Explanation e = read(effects, true);
    REQUIRE(e.stick);
    CHECK(e.stick->s == 0.9);
    CHECK(e.stick->j == 0.4);
    CHECK(e.stick->s_interval[1] == 1.0);
    CHECK(e.stick->j_interval[1] == 0.0);
    CHECK(e.stick->confidence == 0.8);
  }
  // An alternative excludes the stick at any position in the list.
  CHECK_FALSE(read(sticks + ", " + gain_but(R"("backlash")"), true).stick);
  CHECK_FALSE(read(sticks, false).stick);
  CHECK_FALSE(read(gain, true).stick);
  CHECK_FALSE(read("", true).stick);
}

TEST_CASE("the slip of a watched loop has the state of its newest search", "[explain]") {
  const tests::TemporaryFolder folder;
  const auto slip = [&](const std::string& test, const std::string& found) {
    replace_text(folder / "explanation.json",
                 R"({"alarm": "stiction", "final_name": null, "raised_ms": 1, "ended_ms": 2, )"
                 R"("verdict": "missing_effect", "gap_closed": 0.9, "from_s": -60, )"
                 R"("sentence": "", "first": null, "agrees": false, "effects": [], )"
                 R"("next_test": {"text": "Move SP." )" +
                     test + "}}");
    if (!found.empty()) tests::write_file(folder / "test/test.json", found);
    return read_explanation(folder.path()).slip;
  };
  const std::string watched = R"(, "planned_at": 7, "valid_until_ms": 8)";
  CHECK_FALSE(slip("", ""));
  REQUIRE(slip(watched, ""));
  CHECK(slip(watched, "")->state == TestSlip::State::open);
  CHECK(slip(watched, "{")->state == TestSlip::State::open);
  const auto another = slip(
      watched, R"({"planned_at": 7, "done": false, "expired": false, "another_move": "By 3."})");
  CHECK(another->state == TestSlip::State::open);
  CHECK(another->another_move == "By 3.");
  const auto expired =
      slip(watched, R"({"planned_at": 7, "done": false, "expired": true, "another_move": null})");
  CHECK(to_text(*expired) == "expired: the move was not seen in time");
  const std::string done =
      R"("done": true, "competing": "a or b", "probability": 0.97, "decided": "a", )"
      R"("predicted": {"probability_right": 0.9}})";
  CHECK(to_text(*slip(watched, R"({"planned_at": 7, )" + done)) ==
        "done: decided a with probability 0.97");
  // A result of an earlier slip.
  CHECK(slip(watched, R"({"planned_at": 6, )" + done)->state == TestSlip::State::open);
}

}  // namespace explanation_file_test
