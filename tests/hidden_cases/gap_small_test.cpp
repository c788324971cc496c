// SPDX-License-Identifier: Apache-2.0
// `loopwarden gap` itself on a few hidden cases. The full study is loopwarden_gap_study.
#include <catch2/catch.hpp>
#include <filesystem>
#include <vector>

#include "bench/hidden_cases/gap_runner.hpp"
#include "tests/support/temporary_folder.hpp"

namespace gap_small_test {

using namespace loopwarden::hidden_cases;
using loopwarden::tests::TemporaryFolder;

TEST_CASE("of a few easy hidden effects most are named, and none where there is none",
          "[hidden_cases][gap]") {
  const TemporaryFolder folder;
  // Seeds that the study does not reach.
  std::vector<CaseRequest> requests{
      {.id = "bias", .effect = "output_bias", .seed = 200001},
      {.id = "gain", .effect = "gain_change", .seed = 200002},
      {.id = "play", .effect = "backlash", .seed = 200003},
      {.id = "none", .kind = Kind::kNone, .effect = "none", .seed = 200004}};
  for (CaseRequest& request : requests) request.samples = 2400;
  write_cases(folder / "cases", requests);
  const std::vector<ScoredCase> scored =
      run_cases({.path = LOOPWARDEN_BIN_DIR "/loopwarden"}, find_cases(folder / "cases"),
                folder / "out", 1, [](std::size_t) {});
  REQUIRE(scored.size() == 4);
  int right = 0;
  for (const ScoredCase& one : scored) {
    CHECK(one.answer.failure == "");
    right += one.score.right ? 1 : 0;
  }
  CHECK(right >= 3);
  CHECK(scored.back().answer.effects.empty());
}

}  // namespace gap_small_test
