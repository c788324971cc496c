// SPDX-License-Identifier: Apache-2.0
// Measures a window with the specialists of both forms, and the matrix product of the machine as a
// limit.
#include <benchmark/benchmark.h>

#include <Eigen/Core>
#include <array>
#include <vector>

#include "lab/bench/plant1.hpp"
#include "model/plant/simulated_loop.hpp"
#include "model/specialist/judge/ensemble.hpp"
#include "model/specialist/judge/team.hpp"

namespace loopwarden::bench {
namespace {

// Hidden neurons of the thesis's eight specialists, table 8.2.
constexpr std::array<std::size_t, 8> kHidden{10, 20, 31, 10, 20, 20, 10, 20};

struct Samples {
  std::vector<double> pv, co;
};
Samples some_window() {
  plant::SimulatedLoop loop(sticking_plant1(), 10.0 / 4096.0);
  Samples samples;
  for (std::size_t k = 0; k < specialist::kWindowSamples; ++k) {
    const plant::LoopSample s = loop.step();
    samples.pv.push_back(s.pv);
    samples.co.push_back(s.co);
  }
  return samples;
}

// Returns the number of multiplications of all layers on 31 columns.
double products() {
  double sum = 0.0;
  for (const std::size_t h : kHidden) {
    sum += static_cast<double>(specialist::kSide * (2 * specialist::kSide * h + h * h));
  }
  return sum;
}

void eight_specialists(benchmark::State& state) {
  std::vector<specialist::SignatureSpecialist> specialists;
  const Samples samples = some_window();
  for (const std::size_t h : kHidden) {
    specialist::SignatureSpecialist s;
    s.network = specialist::random_network({specialist::kSide, h, h, specialist::kSide}, h);
    s.scaling = {5.0, 5.0};
    s.target = samples.pv;
    specialists.push_back(s);
  }
  specialist::SignatureEnsemble ensemble(specialists);
  for (auto _ : state) benchmark::DoNotOptimize(ensemble.errors(samples.pv).data());
  state.SetItemsProcessed(static_cast<std::int64_t>(products()) *
                          static_cast<std::int64_t>(state.iterations()));
}

// Measures the same number of multiplications in one product of large matrices: the upper limit for
// the networks.
void matrix_limit(benchmark::State& state) {
  constexpr Eigen::Index kSize = 256;
  const Eigen::MatrixXf a = Eigen::MatrixXf::Random(kSize, kSize);
  const Eigen::MatrixXf b = Eigen::MatrixXf::Random(kSize, kSize);
  Eigen::MatrixXf c(kSize, kSize);
  for (auto _ : state) {
    c.noalias() = a * b;
    benchmark::DoNotOptimize(c.data());
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(kSize * kSize * kSize) *
                          static_cast<std::int64_t>(state.iterations()));
}

void explaining_team(benchmark::State& state) {
  const Samples samples = some_window();
  specialist::Team team;
  team.facts = specialist::facts_of(sticking_plant1());
  team.scale.fill(1.0);
  for (std::size_t c = 0; c < specialist::kConditions; ++c) {
    team.members[c].condition = static_cast<specialist::Condition>(c);
    team.members[c].network =
        specialist::random_network({specialist::kNetworkInputs, 16, 16, 1}, c);
  }
  specialist::TeamJudge judge(team);
  for (auto _ : state) benchmark::DoNotOptimize(judge.judge({.pv = samples.pv, .co = samples.co}));
}

BENCHMARK(eight_specialists)->Name("specialist/eight");
BENCHMARK(matrix_limit)->Name("specialist/matrix_limit");
BENCHMARK(explaining_team)->Name("specialist/explaining");

}  // namespace
}  // namespace loopwarden::bench
