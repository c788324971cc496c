// SPDX-License-Identifier: Apache-2.0
#include "model/specialist/judge/ensemble.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "model/specialist/train/growing.hpp"
#include "model/specialist/train/limits.hpp"
#include "tests/model/specialist/judge/specialist_support.hpp"

namespace ensemble_test {

using namespace loopwarden;
using namespace loopwarden::specialist;

namespace {

std::vector<double> some_signature(double phase) {
  std::vector<double> pv(kSignatureSamples);
  for (std::size_t k = 0; k < pv.size(); ++k) {
    pv[k] = 5.0 + 2.0 * std::sin(phase + 0.02 * static_cast<double>(k));
  }
  return pv;
}

SignatureSpecialist some_specialist(std::uint64_t seed, std::size_t hidden, double phase) {
  SignatureSpecialist s;
  s.name = "T" + std::to_string(seed);
  s.condition = static_cast<Condition>(seed % kKnownConditions);
  s.network = random_network({kSide, hidden, hidden, kSide}, seed);
  s.network.layers[2].weights *= 5.0;
  s.scaling = {5.0, 3.0};
  s.target = some_signature(phase);
  return s;
}

}  // namespace

TEST_CASE("a signature is read column by column", "[specialist]") {
  std::vector<double> pv(kSignatureSamples);
  for (std::size_t k = 0; k < pv.size(); ++k) pv[k] = static_cast<double>(k);
  const SignatureMatrix m = signature_matrix(pv, {100.0, 50.0});
  CHECK(m(0, 0) == Approx(-2.0));
  CHECK(m(30, 0) == Approx((30.0 - 100.0) / 50.0));
  CHECK(m(0, 1) == Approx((31.0 - 100.0) / 50.0));
  CHECK(m(7, 12) == Approx((12.0 * 31.0 + 7.0 - 100.0) / 50.0));
  const Scaling s = scaling_of({{1.0, 4.0}, {-2.0, 3.0}});
  CHECK(s.centre == Approx(1.0));
  CHECK(s.half_span == Approx(3.0));
}

TEST_CASE("errors in single precision are those of the networks", "[specialist]") {
  const std::vector<SignatureSpecialist> specialists{
      some_specialist(1, 10, 0.4), some_specialist(2, 20, 1.0), some_specialist(3, 31, 2.0)};
  SignatureEnsemble ensemble(specialists);
  const std::vector<double> pv = some_signature(0.7);
  const std::span<const double> errors = ensemble.errors(pv);
  REQUIRE(errors.size() == 3);
  std::size_t least = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const SignatureSpecialist& s = specialists[i];
    const Eigen::MatrixXd out = s.network.respond(signature_matrix(pv, s.scaling));
    const double expected =
        (out - signature_matrix(s.target, s.scaling)).squaredNorm() / kSignatureSamples * 9.0;
    CHECK(errors[i] == Approx(expected).epsilon(1e-4));
    if (errors[i] < errors[least]) least = i;
  }
  CHECK(ensemble.verdict(pv) == least);
}

TEST_CASE("a signature with a missing sample has no verdict", "[specialist]") {
  SignatureEnsemble ensemble({some_specialist(1, 10, 0.4)});
  std::vector<double> pv = some_signature(0.7);
  CHECK(ensemble.verdict(pv) == 0U);
  pv[500] = std::nan("");
  CHECK_FALSE(ensemble.verdict(pv));
}

TEST_CASE("roles go three to one to one, and the target is the strongest", "[specialist]") {
  std::array<int, 3> count{};
  for (std::size_t i = 0; i < specialist::TrainLimits::kSignaturesOfCondition; ++i) {
    ++count[static_cast<std::size_t>(role_of(i))];
  }
  CHECK(count == std::array{15, 5, 5});
  std::vector<Signature> all;
  for (const double severity : {3.0, 9.0, 5.0}) {
    all.push_back({some_signature(severity), Condition::backlash, severity, Role::training});
  }
  all.push_back({some_signature(0.0), Condition::no_fault, 0.0, Role::training});
  all.push_back({some_signature(0.1), Condition::no_fault, 0.0, Role::training});
  all.push_back({some_signature(1.5), Condition::no_fault, 0.0, Role::training});
  CHECK(target_of(all, Condition::backlash) == 1);
  // The most ordinary of the healthy ones.
  CHECK(target_of(all, Condition::no_fault) == 4);
  CHECK(target_of(all, Condition::stiction) == all.size());
  // Measured signatures have no severity: the farthest from healthy is taken.
  for (Signature& s : all) s.severity_percent = 0.0;
  CHECK(target_of(all, Condition::backlash) == 0);
}

TEST_CASE("specialists of two conditions separate fresh signatures, with and without components",
          "[specialist]") {
  const plant::LoopModel model = tests::flow_loop();
  std::vector<Signature> all;
  std::vector<std::vector<double>> columns;
  for (const Condition c : {Condition::no_fault, Condition::hysteresis}) {
    for (std::size_t i = 0; i < 10; ++i) {
      all.push_back(simulate_signature(model, c, 100 * static_cast<std::uint64_t>(c) + i));
      all.back().role = role_of(i);
      columns.push_back(all.back().pv);
    }
  }
  const Scaling scaling = scaling_of(columns);
  for (const std::size_t components : {kSide, std::size_t{6}}) {
    GrowingSettings settings;
    settings.sizes = {6};
    settings.components = components;
    settings.learning.most_epochs = 8;
    const std::vector<SignatureSpecialist> specialists{
        grow(all, Condition::no_fault, scaling, settings).specialist,
        grow(all, Condition::hysteresis, scaling, settings).specialist};
    CHECK(specialists[0].network.shape() == NetworkShape{kSide, 6, 6, kSide});
    SignatureEnsemble ensemble(specialists);
    int right = 0;
    for (std::uint64_t seed = 900; seed < 905; ++seed) {
      right += ensemble.verdict(simulate_signature(model, Condition::no_fault, seed).pv) == 0U;
      right += ensemble.verdict(simulate_signature(model, Condition::hysteresis, seed).pv) == 1U;
    }
    CHECK(right >= 9);
  }
}

}  // namespace ensemble_test
