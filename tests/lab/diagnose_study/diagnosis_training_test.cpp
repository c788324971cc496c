// SPDX-License-Identifier: Apache-2.0
#include "lab/diagnose_study/diagnosis_training.hpp"

#include <catch2/catch.hpp>
#include <functional>
#include <set>
#include <vector>

#include "model/diagnosis/classifier.hpp"
#include "model/numeric/random.hpp"
#include "lab/diagnose_study/diagnosis_cases.hpp"

namespace loopwarden::tests::diagnosis_training_test {

TEST_CASE("a simulated case is the same for the same seed, and every cause is drawn") {
  const lab::DiagnosisCase first = lab::diagnosis_case(7, 3);
  CHECK(first.pv == lab::diagnosis_case(7, 3).pv);
  CHECK(first.pv != lab::diagnosis_case(8, 3).pv);
  std::set<diagnosis::Cause> causes;
  for (std::size_t i = 0; i < 60; ++i) causes.insert(lab::diagnosis_case(7, i).cause);
  CHECK(causes.size() == diagnosis::kCauseCount);
}

TEST_CASE("each ingredient of the simulated loops can be left out, and makes a difference") {
  const auto differs = [](std::size_t ingredient) {
    lab::Ingredients without = lab::all_ingredients();
    without.reset(ingredient);
    for (std::size_t i = 0; i < 300; ++i) {
      if (lab::diagnosis_case(7, i).pv != lab::diagnosis_case(7, i, without).pv) return true;
    }
    return false;
  };
  for (std::size_t i = 0; i < lab::all_ingredients().size(); ++i) {
    CAPTURE(i);
    CHECK(differs(i));
  }
}

TEST_CASE("training finds the evidence that separates the causes, with any number of threads") {
  numeric::Random random(2);
  std::vector<lab::LabelledFeatures> cases(600);
  for (auto& c : cases) {
    for (double& v : c.features) v = random.uniform();
    const bool sticky = c.features[5] > 0.5 && c.features[9] < 0.6;
    c.cause = sticky ? diagnosis::Cause::stiction : diagnosis::Cause::none;
  }
  const auto forwards = [](std::size_t n, const std::function<void(std::size_t)>& f) {
    for (std::size_t i = 0; i < n; ++i) f(i);
  };
  const auto backwards = [](std::size_t n, const std::function<void(std::size_t)>& f) {
    for (std::size_t i = n; i-- > 0;) f(i);
  };
  const lab::TrainingSettings settings{.rounds = 40, .rate = 0.2, .columns = 0.9};
  const lab::TrainedTable table = lab::train(cases, settings, forwards);
  std::size_t right = 0;
  for (const auto& c : cases) {
    const auto p = diagnosis::weigh(table.view(), c.features);
    const bool sticky = p[static_cast<std::size_t>(diagnosis::Cause::stiction)] > 0.5;
    right += sticky == (c.cause == diagnosis::Cause::stiction) ? 1U : 0U;
  }
  CHECK(right >= 590);
  CHECK(lab::table_text(table, "x") ==
        lab::table_text(lab::train(cases, settings, backwards), "x"));
}

}  // namespace loopwarden::tests::diagnosis_training_test
