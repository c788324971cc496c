// SPDX-License-Identifier: Apache-2.0
// The smallest move of a loop that tells its explanations apart.
//
// Every explanation is simulated with samples of its posterior, with noise and disturbance, while
// the loop moves. All moves are first judged by PV of free runs of samples under the same CO,
// whitened by the filter of the error (test_evidence.hpp):
//
//   log p(record | explanation) = log mean over its samples of exp(-1/2 sum of innovations^2)
//
// The best moves are then judged by `judge`, which is the estimator itself.
//
// A test decides if one explanation reaches 0.9. It is right if this is the simulated one.
//
//   P(right) = sum over explanations of probability * share of its simulated tests that are right
//
// Moves are tried from small to large, within classes that plants use: the move adds at most 1 % of
// the span of PV (technician), 3 % (operator) or 5 % (test day) to its deviations. Moves of SP come
// first, because the loop stays in automatic; moves of the output in manual follow.
//
// Limits: the loop is taken to rest at its last SP, so what disturbs it now goes on at random.
// An explanation without a law ("unnamed") can't be simulated.
// Sources: Cavagnaro, Myung, Pitt and Kujala, Neural Computation 22 (2010) 887-905 (choice of a
// test by the expected decision between models).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "model/estimator/blocks.hpp"
#include "model/numeric/parallel.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::estimator {

// Least probability of an explanation that a test has to tell from others. By hand.
inline constexpr double kCompetes = 0.05;
// Probability of one explanation at which a test decides. Chosen on lab/plan_study, seeds 800200 to
// 800223.
inline constexpr double kDecides = 0.9;
// Probability of a right decision from which on a cheaper test is preferred to a surer one.
inline constexpr double kWanted = 0.9;

struct Explanation {
  std::vector<std::string> effects;  // empty: nothing is missing
  double probability = 0.0;
  std::vector<plant::LoopModel> samples;  // of its posterior, without noise
};

// Moves there by `size` and back to the start.
enum class MoveKind : std::uint8_t {
  set_point_pair,      // one step there, one back
  set_point_reversal,  // there, as far to the other side, and back
  set_point_stairs,    // three steps there, three back
  set_point_ramp,      // there and back at one rate, then at rest
  output_pair,         // the same in manual
  output_reversal,
  output_stairs,
  output_ramp
};
const char* to_text(MoveKind kind) noexcept;
// nullopt: no such kind.
std::optional<MoveKind> move_from_text(std::string_view text) noexcept;
constexpr bool in_manual(MoveKind kind) noexcept { return kind >= MoveKind::output_pair; }

struct Move {
  MoveKind kind = MoveKind::set_point_pair;
  double size = 0.0;    // largest distance from the start: PV units for SP, CO units for the output
  double hold_s = 0.0;  // of each step, or of each way of a ramp
};
double duration_s(const Move& move) noexcept;
// SP or output at `time_s` after the start of the move, which begins at `from`. `from` before the
// move, and at its end.
double moved(const Move& move, double from, double time_s) noexcept;

// The sample of an explanation that made a simulated test.
struct Drawn {
  std::size_t explanation = 0;
  std::size_t sample = 0;
};

// The loop at the start of a test.
struct TestStart {
  double set_point = 0.0;              // PV units
  double output = 0.0;                 // CO units
  std::array<double, 2> set_points{};  // PV units: limits of a move; equal: SP can't move
  std::array<double, 2> outputs{};     // CO units
  double noise_rms = 0.0;              // PV units
  double disturbance = 0.0;            // PV units per root second
  double law_error = 0.0;              // PV units: of the explanations themselves
  double most_pv_share = 0.05;         // of the span of PV: largest class that is allowed
  double longest_s = 1800.0;
  // Probabilities of the explanations after the record of a simulated test, which starts some
  // answer times before the move. Empty: the samples of the explanations judge a test.
  std::function<std::vector<double>(const Observed& test, Drawn from)> judge{};
};

// PV of one explanation during a test: 90 % of its simulated tests.
struct Predicted {
  std::vector<double> low, middle, high;  // PV units
};

struct TestPlan {
  Move move;
  double duration_s = 0.0;
  double probability_right = 0.0;
  double probability_wrong = 0.0;
  double class_share = 0.0;            // of the span of PV, that the move adds
  double pv_swing = 0.0;               // PV units: largest deviation from SP before the test
  double output_swing = 0.0;           // CO units: largest deviation from the output before
  std::vector<double> time_s{};        // from the start of the test
  std::vector<double> moved{};         // SP (PV units) or output (CO units)
  std::vector<Predicted> predicted{};  // one per explanation
};

struct Planned {
  // The cheapest test with P(right) of kWanted. If there is none, the one that decides most often,
  // if P(right) is at least 0.5 and its decisions are right nine times out of ten.
  std::optional<TestPlan> plan;
  // The best test of the next class, if it would decide more often.
  std::optional<TestPlan> next;
  // Without a plan: a sentence, and the best test that was found.
  std::string why_not;
  std::optional<TestPlan> best;
  // Without a plan: a test that would decide, outside the limits, with sizes of up to 20 %.
  std::optional<TestPlan> beyond;
};

// `explanations`: at least two, with samples of the same sample time.
Planned propose_test(const std::vector<Explanation>& explanations, const TestStart& start,
                     const numeric::ParallelFor& parallel);

}  // namespace loopwarden::estimator
