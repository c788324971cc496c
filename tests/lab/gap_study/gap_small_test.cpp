// SPDX-License-Identifier: Apache-2.0
// `loopwarden gap` itself on a few hidden cases. The full study is loopwarden-study gap.
#include <catch2/catch.hpp>
#include <filesystem>
#include <vector>

#include "lab/hidden_cases/hidden_case.hpp"
#include "lab/gap_study/gap_runner.hpp"
#include "tests/support/temporary_folder.hpp"

namespace gap_small_test {

using namespace loopwarden::lab::gap_study;
using loopwarden::tests::TemporaryFolder;

TEST_CASE("a few easy hidden effects are each named, and a case without an effect gets no name",
          "[hidden_cases][gap]") {
  const TemporaryFolder folder;
  // Development seeds: the held-out ones, from 100000 on, are only for the study.
  std::vector<loopwarden::hidden_cases::CaseRequest> requests{
      {.id = "bias", .effect = "output_bias", .seed = 60005},
      {.id = "drift", .effect = "drift", .seed = 70003},
      {.id = "late", .effect = "extra_dead_time", .seed = 70005},
      {.id = "none",
       .kind = loopwarden::hidden_cases::Kind::kNone,
       .effect = "none",
       .seed = 60015}};
  for (auto& request : requests) request.samples = 2000;
  loopwarden::hidden_cases::write_cases(folder / "cases", requests);
  const std::vector<ScoredCase> scored =
      run_cases({.path = LOOPWARDEN_BIN_DIR "/loopwarden"}, find_cases(folder / "cases"),
                folder / "out", 1, [](std::size_t) {});
  REQUIRE(scored.size() == 4);
  for (const ScoredCase& one : scored) {
    CAPTURE(one.truth.id, one.answer.failure, label_of(one.answer));
    CHECK(one.score.right);
  }
}

}  // namespace gap_small_test
