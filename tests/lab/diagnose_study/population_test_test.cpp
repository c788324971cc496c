// SPDX-License-Identifier: Apache-2.0
#include "lab/diagnose_study/population_test.hpp"

#include <catch2/catch.hpp>
#include <functional>
#include <string>
#include <vector>

#include "model/numeric/random.hpp"

namespace loopwarden::tests::population_test_test {

using lab::Evidence;

void in_turn(std::size_t count, const std::function<void(std::size_t)>& body) {
  for (std::size_t i = 0; i < count; ++i) body(i);
}

// Three numbers per window. The second is shifted if the loop is measured. Sticky loops have values
// apart from the others.
std::vector<Evidence> population(std::uint64_t seed, std::size_t loops, bool measured,
                                 double shift) {
  numeric::Random random(seed);
  std::vector<Evidence> all;
  for (std::size_t i = 0; i < loops; ++i) {
    const bool sticky = measured ? i % 4 != 0 : i % 4 == 0;  // other shares in either population
    for (std::size_t window = 0; window < (measured ? 2U : 1U); ++window) {
      all.push_back({.numbers = {random.normal() + (sticky ? 6.0 : 0.0), random.normal() + shift,
                                 random.normal()},
                     .plant = measured ? std::string(1, static_cast<char>('a' + i % 3)) : "",
                     .loop = std::to_string(i),
                     .kind = "flow",
                     .sticky = sticky});
    }
  }
  return all;
}

TEST_CASE(
    "population test: alike populations with other shares of sticky loops can't be distinguished") {
  const auto test =
      lab::test_population(population(1, 300, false, 0.0), population(2, 48, true, 0.0), in_turn);
  CHECK(test.loops == 48);
  CHECK(test.simulated == 300);
  CHECK(test.plants.size() == 3);
  CHECK(test.auc == Approx(0.5).margin(0.12));
  CHECK(test.auc_low < test.auc);
  CHECK(test.auc_high > test.auc);
  CHECK(test.p > 0.05);
}

TEST_CASE("population test: a shift of one number is seen in plants that were not trained on") {
  const auto test =
      lab::test_population(population(1, 300, false, 0.0), population(2, 48, true, 2.0), in_turn);
  CHECK(test.auc_low > 0.8);
  CHECK(test.p <= 0.01);
  for (const auto& plant : test.plants) CHECK(plant.auc > 0.75);
}

TEST_CASE("population test: kinds without a counterpart are left out, one plant gives no result") {
  auto measured = population(2, 12, true, 0.0);
  for (auto& e : measured) {
    if (e.plant == "a") e.kind = "level";
  }
  const auto simulated = population(1, 60, false, 0.0);
  CHECK(lab::test_population(simulated, measured, in_turn).loops == 8);
  for (auto& e : measured) e.plant = "a";
  const auto single = lab::test_population(simulated, measured, in_turn);
  CHECK(single.plants.empty());
  CHECK(single.p == 1.0);
}

}  // namespace loopwarden::tests::population_test_test
