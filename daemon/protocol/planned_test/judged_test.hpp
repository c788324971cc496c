// SPDX-License-Identifier: Apache-2.0
// Judges a test that was carried out, together with the record of its planning.
#pragma once

#include <optional>
#include <string>

#include "daemon/protocol/planned_test/planned_test.hpp"
#include "daemon/protocol/planned_test/test_plan_file.hpp"
#include "model/estimator/judge_test.hpp"
#include "model/numeric/parallel.hpp"
#include "model/plant/loop_model.hpp"
#include "record/record_csv.hpp"

namespace loopwarden::protocol {

struct JudgedTest {
  std::optional<estimator::Judged> judged;
  std::string why_not;  // why it is not judged
};

// `record`, `model`: of the planning.
JudgedTest judge_test(const TestPlanFile& plan, const TestRecord& test,
                      const record::Record& record, const plant::LoopModel& model,
                      const numeric::ParallelFor& parallel);

// Returns the explanation that the test decides for, and its probability; empty and 0: undecided.
struct Decision {
  std::string name;
  double probability = 0.0;
};
Decision decision_of(const TestPlanFile& plan, const JudgedTest& test);
// Returns the decision in one sentence.
std::string sentence_of(const TestPlanFile& plan, const JudgedTest& test);

struct Swing {
  double pv = 0.0;  // PV units: largest deviation from SP before the move
  double co = 0.0;  // CO units: largest deviation from the output before the move
};
Swing swing_of(const TestRecord& test);

}  // namespace loopwarden::protocol
