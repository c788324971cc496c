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

}  // namespace explanation_file_test
