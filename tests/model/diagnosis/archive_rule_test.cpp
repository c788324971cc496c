// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/archive_rule.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

namespace loopwarden::tests::archive_rule_test {
namespace {

using namespace loopwarden::diagnosis;
using analysis::ArchivedSignal;
using analysis::ArchiveKind;

ArchivedSignal kept_to(double deviation) {
  return {.kind = ArchiveKind::exception, .deviation = deviation};
}

TEST_CASE("the limit of detection is the coarser of CO and PV, in CO units", "[archive]") {
  std::vector<double> pv;
  std::vector<double> co;
  for (int k = 0; k < 1000; ++k) {
    co.push_back(50.0 + 10.0 * std::sin(0.1 * k));
    pv.push_back(20.0 + 5.0 * std::sin(0.1 * k - 0.5));
  }
  CHECK(sees_from(pv, co, {}) == 0.0);
  CHECK(sees_from(pv, co, {{}, kept_to(0.5)}) == Approx(1.0));
  CHECK(sees_from(pv, co, {kept_to(0.5), kept_to(0.1)}) == Approx(2.0).epsilon(0.05));
  CHECK(std::isinf(sees_from(pv, co, {{.kind = ArchiveKind::unknown}, {}})));
}

TEST_CASE("a verdict is valid only if the archive kept the evidence for it", "[archive]") {
  const double span = 100.0;
  const double moves = 20.0;
  // No value was omitted.
  CHECK_FALSE(hidden(DiagnosisVerdict::valve_effect, Cause::stiction, 0.1, 0.0, moves, span));
  CHECK(hidden(DiagnosisVerdict::valve_effect, Cause::stiction, 0.9, 1.0, moves, span));
  CHECK_FALSE(hidden(DiagnosisVerdict::valve_effect, Cause::stiction, 5.0, 1.0, moves, span));
  CHECK_FALSE(hidden(DiagnosisVerdict::healthy, Cause::none, 0.0, 1.0, moves, span));
  CHECK(hidden(DiagnosisVerdict::healthy, Cause::none, 0.0, 4.0, moves, span));
  CHECK(hidden(DiagnosisVerdict::other_cause, Cause::disturbance, 0.0, 1.0, 2.0, span));
  // A finding of a gate is also visible in a coarse record.
  CHECK_FALSE(hidden(DiagnosisVerdict::other_cause, Cause::saturation, 0.0, 4.0, moves, span));
}

TEST_CASE("a hidden verdict reports the reason and the data that would settle it", "[archive]") {
  Diagnosis d;
  d.verdict = DiagnosisVerdict::valve_effect;
  d.grade = Grade::seen;
  d.cause = Cause::stiction;
  d.s = 0.5;
  mind_archive(d, 1.0, 100.0);
  CHECK(d.verdict == DiagnosisVerdict::cant_tell);
  CHECK(d.grade == Grade::none);
  CHECK(d.reason == kHiddenReason);
  CHECK(d.settle == kHiddenSettle);
}

TEST_CASE("an effect that the archive hides in the windows is hidden from the loop", "[archive]") {
  Diagnosis like;
  like.s = 5.0;
  LoopVerdict loop;
  loop.verdict = DiagnosisVerdict::valve_effect;
  mind_archive(loop, like, 1.0, 100.0);
  CHECK(loop.verdict == DiagnosisVerdict::valve_effect);
  mind_archive(loop, like, 6.0, 100.0);
  CHECK(loop.verdict == DiagnosisVerdict::cant_tell);
}

}  // namespace
}  // namespace loopwarden::tests::archive_rule_test
