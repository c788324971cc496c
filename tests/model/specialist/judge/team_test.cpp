// SPDX-License-Identifier: Apache-2.0
#include "model/specialist/judge/team.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/model/specialist/judge/specialist_support.hpp"
#include "tests/support/rt_guard.hpp"

namespace team_test {

using namespace loopwarden;
using namespace loopwarden::specialist;

namespace {

TeamTraining small_team(const ParallelFor& parallel_for) {
  const plant::LoopModel model = tests::flow_loop();
  TeamTrainingSettings settings;
  settings.hidden = 8;
  settings.restarts = 2;
  settings.most_epochs = 25;
  return train_team(facts_of(model), simulate_examples(model, 1400, 5, parallel_for), settings,
                    parallel_for);
}

const TeamTraining& trained() {
  static const TeamTraining result = small_team(tests::one_thread());
  return result;
}

// A team whose networks return the scores of the test, whatever the evidence: softmax of `scores`.
Team puppet_team(const std::array<double, kConditions>& scores) {
  Team team;
  team.facts = facts_of(tests::flow_loop());
  team.scale.fill(1.0);
  for (std::size_t c = 0; c < kConditions; ++c) {
    team.members[c].condition = static_cast<Condition>(c);
    team.members[c].network = Network({kNetworkInputs, 1, 1, 1});
    team.members[c].network.layers[2].bias(0) = scores[c];
    team.members[c].most_misfit = 1.0;
  }
  return team;
}

}  // namespace

TEST_CASE("names of conditions and verdicts are those of the files", "[specialist]") {
  CHECK(condition_of("low_air_supply") == Condition::low_air_supply);
  CHECK_FALSE(condition_of("other"));
  CHECK_FALSE(condition_of("sticky"));
  CHECK(std::string(to_text(VerdictName::not_enough_movement)) == "not_enough_movement");
  for (std::size_t c = 0; c < kKnownConditions; ++c) {
    CHECK(std::string(to_text(static_cast<Condition>(c))) == to_text(static_cast<VerdictName>(c)));
  }
}

TEST_CASE("a fault is no larger than the window's evidence of it", "[specialist]") {
  WindowFits f = tests::plain_fits();
  f.co_range = 3.0;
  f.pv_range = 5.0;
  // The fits have found 6 %.
  CHECK(severity_of(f, Condition::stiction) == 3.0);
  CHECK(severity_of(f, Condition::backlash) == 3.0);
  CHECK(severity_of(f, Condition::hysteresis) == 3.0);
  CHECK(severity_of(f, Condition::low_air_supply) == 5.0);
  // An offset moves PV without CO.
  f.fits[static_cast<std::size_t>(FaultModel::hysteresis_offset)].mse = 0.01;
  f.fits[static_cast<std::size_t>(FaultModel::hysteresis_offset)].size = -6.0;
  CHECK(severity_of(f, Condition::hysteresis) == 5.0);
  f.pv_range = 20.0;
  CHECK(severity_of(f, Condition::hysteresis) == 6.0);
  CHECK(severity_of(f, Condition::low_air_supply) == 6.0);
  CHECK(severity_of(f, Condition::no_fault) == 0.0);
  // The verdict agrees.
  const WindowVerdict verdict = TeamJudge(puppet_team({0.0, 9.0, 0.0, 0.0, 0.0, 0.0})).judge(f);
  CHECK(verdict.verdict == VerdictName::stiction);
  CHECK(verdict.severity_percent == 3.0);
}

TEST_CASE("the verdict follows the probabilities, the fit and the movement", "[specialist]") {
  const WindowFits plain = tests::plain_fits();
  // no_fault, stiction, backlash, hysteresis, low air, other
  const auto verdict = [](const std::array<double, kConditions>& scores, const WindowFits& f) {
    return TeamJudge(puppet_team(scores)).judge(f);
  };
  const WindowVerdict sticky = verdict({0, 6, 3, 0, 0, 0}, plain);
  CHECK(sticky.verdict == VerdictName::stiction);
  CHECK(sticky.severity_percent == Approx(6.0));
  CHECK(sticky.probability == Approx(std::exp(6.0) / (std::exp(6.0) + std::exp(3.0) + 4.0)));
  CHECK(verdict({6, 0, 0, 0, 0, 0}, plain).verdict == VerdictName::no_fault);
  CHECK(verdict({6, 0, 0, 0, 0, 0}, plain).severity_percent == 0.0);
  CHECK(verdict({0, 0, 0, 0, 0, 6}, plain).verdict == VerdictName::unknown);
  // The faults together are sure, but no single one is: the window can't separate them.
  CHECK(verdict({0, 0, 7, 6.9, 0, 0}, plain).verdict == VerdictName::not_enough_movement);
  CHECK(verdict({0, 0, 7, 5, 0, 0}, plain).verdict == VerdictName::backlash);
  // Something is wrong, but it may also be a fault.
  CHECK(verdict({0, 0, 0, 0, 5, 5.5}, plain).verdict == VerdictName::not_enough_movement);
  WindowFits shut = plain;
  shut.shut_share = 0.4;
  CHECK(verdict({0, 6, 0, 0, 0, 0}, shut).verdict == VerdictName::not_enough_movement);
  // Undecided between healthy and a fault that would not show.
  CHECK(verdict({2, 2, 0, 0, 0, 0}, plain).verdict == VerdictName::not_enough_movement);

  WindowFits misfit = plain;
  for (FaultFit& fit : misfit.fits) fit.mse = 1.0;
  CHECK(verdict({0, 6, 0, 0, 0, 0}, misfit).verdict == VerdictName::unknown);
  CHECK(verdict({6, 0, 0, 0, 0, 0}, misfit).verdict == VerdictName::unknown);
  WindowFits still = plain;
  still.co_range = 0.3;
  CHECK(verdict({6, 0, 0, 0, 0, 0}, still).verdict == VerdictName::not_enough_movement);
  CHECK(verdict({0, 0, 0, 0, 0, 6}, still).verdict == VerdictName::not_enough_movement);
  CHECK(verdict({0, 6, 0, 0, 0, 0}, WindowFits{}).verdict == VerdictName::not_enough_movement);
}

TEST_CASE("hysteresis is explained by the better of its two forms", "[specialist]") {
  WindowFits f = tests::plain_fits();
  f.fits[static_cast<std::size_t>(FaultModel::hysteresis_offset)].mse = 0.01;
  f.fits[static_cast<std::size_t>(FaultModel::hysteresis_offset)].size = -4.0;
  CHECK(misfit_of(f, Condition::hysteresis) == 0.01);
  CHECK(severity_of(f, Condition::hysteresis) == 4.0);
  CHECK(severity_of(f, Condition::other) == 0.0);
}

TEST_CASE("a trained team recognises play from code other than its own, and a healthy valve",
          "[specialist][long]") {
  TeamJudge judge(trained().team);
  const WindowVerdict play = judge.judge(tests::play_window(0.7, 0.02).view());
  CHECK(play.verdict == VerdictName::backlash);
  CHECK(play.severity_percent == Approx(7.0).epsilon(0.1));
  const WindowVerdict healthy = judge.judge(tests::play_window(0.0, 0.02).view());
  CHECK_FALSE(names_fault(healthy.verdict));
  CHECK(healthy.verdict != VerdictName::unknown);
  double sum = 0.0;
  for (const double p : play.probabilities) sum += p;
  CHECK(sum == Approx(1.0));
}

TEST_CASE("fresh windows with a clear fault are named right, few healthy ones are named",
          "[specialist][long]") {
  TeamJudge judge(trained().team);
  const plant::LoopModel model = tests::flow_loop();
  int wrong = 0;
  int decided = 0;
  int named = 0;
  for (std::uint64_t seed = 5000; seed < 5030; ++seed) {
    const auto verdict_on = [&](Condition c) {
      return judge
          .judge(simulate_window(model, {.condition = c, .severity_percent = 8.0}, seed).view())
          .verdict;
    };
    wrong += names_fault(verdict_on(Condition::no_fault)) ? 1 : 0;
    for (const Condition c : {Condition::backlash, Condition::stiction}) {
      const VerdictName verdict = verdict_on(c);
      decided += verdict != VerdictName::not_enough_movement ? 1 : 0;
      named += static_cast<std::size_t>(verdict) == static_cast<std::size_t>(c) ? 1 : 0;
    }
  }
  INFO(named << " of " << decided << " verdicts on 60 windows");
  CHECK(wrong <= 1);
  CHECK(named >= 20);
  CHECK(10 * named >= 9 * decided);
}

TEST_CASE("training depends only on the seed, not on the order of the work", "[specialist][long]") {
  const TeamTraining again = small_team(tests::backwards());
  REQUIRE(again.epochs.size() == trained().epochs.size());
  CHECK(again.validation == trained().validation);
  for (std::size_t c = 0; c < kConditions; ++c) {
    CHECK(again.team.members[c].network.layers[0].weights ==
          trained().team.members[c].network.layers[0].weights);
  }
}

TEST_CASE("a finished restart is reused instead of trained again", "[specialist]") {
  const plant::LoopModel model = tests::flow_loop();
  const std::vector<Example> examples = simulate_examples(model, 700, 5, tests::one_thread());
  TeamTrainingSettings settings;
  settings.hidden = 4;
  settings.most_epochs = 3;
  std::vector<TeamRestart> kept(settings.restarts);
  TeamHooks hooks;
  hooks.finished = [&](std::size_t r, const TeamRestart& restart) { kept[r] = restart; };
  const TeamTraining first =
      train_team(facts_of(model), examples, settings, tests::one_thread(), hooks);
  int trained_again = 0;
  hooks.find = [&](std::size_t r) { return r == 0 ? std::optional(kept[0]) : std::nullopt; };
  hooks.finished = [&](std::size_t, const TeamRestart&) { ++trained_again; };
  const TeamTraining second =
      train_team(facts_of(model), examples, settings, tests::one_thread(), hooks);
  CHECK(trained_again == 1);
  CHECK(second.validation == first.validation);
}

TEST_CASE("judging a window does not allocate", "[specialist]") {
  TeamJudge judge(trained().team);
  const tests::PlayWindow w = tests::play_window(0.7, 0.02);
  tests::RealTimeSection::reset();
  VerdictName verdict = VerdictName::unknown;
  {
    const tests::RealTimeSection section;
    verdict = judge.judge(w.view()).verdict;
  }
  CHECK(verdict == VerdictName::backlash);
  CHECK(tests::RealTimeSection::offences() == 0);
}

}  // namespace team_test
