// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "model/estimator/blocks.hpp"
#include "model/estimator/constants.hpp"
#include "model/estimator/error_filter.hpp"
#include "model/numeric/statistics.hpp"
#include "model/numeric/text.hpp"
#include "model/plant/simulated_loop.hpp"

namespace loopwarden::estimator {
namespace {

constexpr std::array<double, 3> kClasses{0.01, 0.03, 0.05};  // of the span of PV
constexpr std::array<double, 7> kSizes{0.0025, 0.005, 0.01, 0.015, 0.02, 0.03, 0.05};  // of a span
constexpr std::array<double, 3> kHolds{3.0, 8.0, 20.0};  // answer times
constexpr double kWanted = 0.9;                          // probability of a right decision
constexpr double kWarmUp = 20.0;                         // answer times before the move
constexpr std::size_t kRivals = 6;                       // samples that judge a simulated test
constexpr std::size_t kFirstTests = 6;                   // of each explanation
constexpr std::size_t kTests = 50;
constexpr double kFirstError = 0.1;  // of the share of right decisions after the first tests
constexpr double kReturns_s = 300.0;
constexpr double kNextGain = 0.02;  // more right decisions that make the next class worth naming
constexpr double kStairs = 3.0;
constexpr std::array kKinds{MoveKind::set_point_pair,   MoveKind::set_point_reversal,
                            MoveKind::set_point_stairs, MoveKind::set_point_ramp,
                            MoveKind::output_pair,      MoveKind::output_reversal,
                            MoveKind::output_stairs,    MoveKind::output_ramp};

// A simulated test, from its start on.
struct Run {
  std::vector<double> co, pv;
  std::size_t begin = 0;  // sample of the first step
};

struct Score {
  double right = 0.0;
  double wrong = 0.0;
  double pv_swing = 0.0;
  double output_swing = 0.0;
};

class Planner {
 public:
  Planner(const std::vector<Explanation>& explanations, const TestStart& start,
          const numeric::ParallelFor& parallel)
      : explanations_(explanations),
        start_(start),
        parallel_(parallel),
        model_(explanations.front().samples.front()),
        pv_span_(model_.transmitter.span()),
        answer_s_(std::max(plant::answer_s(model_), model_.sample_time_s)) {
    double sum = 0.0;
    for (const Explanation& e : explanations_) sum += e.probability;
    for (const Explanation& e : explanations_) weight_.push_back(e.probability / sum);
  }

  Planned plan() {
    Planned out;
    double best = 0.0;
    for (const double share : kClasses) {
      if (share > start_.most_pv_share + 1e-9) break;
      const std::optional<TestPlan> of_class = cheapest(share, out.plan ? 1.0 : kWanted);
      if (!of_class) continue;
      if (out.plan) {
        if (of_class->probability_right > out.plan->probability_right + kNextGain) {
          out.next = of_class;
        }
        break;
      }
      if (of_class->probability_right >= kWanted) {
        out.plan = of_class;
      } else if (of_class->probability_right > best) {
        best = of_class->probability_right;
        out.best = of_class;
      }
    }
    if (!out.plan) out.why_not = why_not(out.best);
    return out;
  }

 private:
  std::vector<Move> moves() const {
    std::vector<Move> all;
    const double co_span = model_.controller.pid.output_span();
    for (const MoveKind kind : kKinds) {
      for (const double size : kSizes) {
        for (const double hold : kHolds) {
          Move move{kind, size * (in_manual(kind) ? co_span : pv_span_), hold * answer_s_};
          const auto& limits = in_manual(kind) ? start_.outputs : start_.set_points;
          const double from = in_manual(kind) ? start_.output : start_.set_point;
          if (from + move.size > limits[1]) move.size = -move.size;
          if (!within(move, from, limits) || duration_s(move) > start_.longest_s) continue;
          all.push_back(move);
        }
      }
    }
    return all;
  }

  static bool within(const Move& move, double from, const std::array<double, 2>& limits) {
    for (double part = 0.0; part < 1.0; part += 0.01) {
      const double at = moved(move, from, part * duration_s(move));
      if (at < limits[0] || at > limits[1]) return false;
    }
    return true;
  }

  // The cheapest move whose PV stays within `share` of the span and that decides with probability
  // `wanted`; otherwise the one that decides most often.
  std::optional<TestPlan> cheapest(double share, double wanted) {
    struct Tried {
      Move move;
      Score score;
    };
    std::vector<Move> all = moves();
    std::vector<Tried> tried(all.size());
    parallel_(all.size(), [&](std::size_t i) {
      if (std::abs(all[i].size) > share * 2.0 * pv_span_ && !in_manual(all[i].kind)) return;
      tried[i] = {all[i], score(all[i], kFirstTests)};
    });
    const double most = share * pv_span_;
    std::erase_if(tried,
                  [&](const Tried& t) { return t.move.size == 0.0 || t.score.pv_swing > most; });
    // In automatic first, then by deviation and duration.
    std::stable_sort(tried.begin(), tried.end(), [&](const Tried& a, const Tried& b) {
      const bool manual_a = in_manual(a.move.kind);
      const bool manual_b = in_manual(b.move.kind);
      if (manual_a != manual_b) return manual_b;
      return cost(a.move, a.score) < cost(b.move, b.score);
    });
    std::optional<std::pair<Move, Score>> best;
    constexpr std::size_t kMostChecked = 8;
    std::size_t checked = 0;
    for (const Tried& t : tried) {
      if (t.score.right < std::min(wanted, 0.99) - kFirstError) continue;
      if (checked++ == kMostChecked) break;
      const Score s = score(t.move, kTests);
      if (s.pv_swing > most) continue;
      if (!best || s.right > best->second.right) best = {t.move, s};
      if (s.right >= wanted) break;
    }
    if (!best) {
      for (const Tried& t : tried) {
        if (!best || t.score.right > best->second.right) best = {t.move, t.score};
      }
      if (best) best->second = score(best->first, kTests);
    }
    if (!best) return std::nullopt;
    return described(best->first, best->second, share);
  }

  double cost(const Move& move, const Score& s) const {
    return s.pv_swing / pv_span_ + 0.01 * duration_s(move) / start_.longest_s;
  }

  // A sample of an explanation as it would be measured.
  plant::LoopModel measured(const plant::LoopModel& sample, std::uint64_t seed) const {
    plant::LoopModel model = sample;
    model.transmitter.noise = start_.noise_rms;
    if (start_.disturbance > 0.0) {
      model.disturbances.push_back(
          {"random_load", {{"intensity", start_.disturbance}, {"time_constant", kReturns_s}}});
    }
    model.scenario.seed = seed;
    model.scenario.set_point = {{0.0, start_.set_point}};
    return model;
  }

  double warm_up_s() const { return std::min(kWarmUp * answer_s_, start_.longest_s); }
  std::size_t samples(double seconds) const {
    return static_cast<std::size_t>(std::ceil(seconds / model_.sample_time_s));
  }
  double seconds(std::size_t samples) const {
    return static_cast<double>(samples) * model_.sample_time_s;
  }

  Run simulate(const plant::LoopModel& sample, const Move& move, std::uint64_t seed) const {
    const plant::LoopModel model = measured(sample, seed);
    plant::SimulatedLoop loop(model);
    Run run;
    run.begin = samples(warm_up_s());
    const std::size_t end = run.begin + samples(duration_s(move));
    const bool manual = in_manual(move.kind);
    for (std::size_t k = 0; k < (manual ? run.begin : end); ++k) {
      if (k >= run.begin) {
        loop.controller().request_set_point(moved(move, start_.set_point, seconds(k - run.begin)));
      }
      const plant::LoopSample s = loop.step();
      run.co.push_back(s.co);
      run.pv.push_back(s.pv);
    }
    if (!manual) return run;
    plant::Plant plant = loop.plant();
    const double from = run.co.back();
    const control::PidSettings& pid = model.controller.pid;
    for (std::size_t k = run.begin; k < end; ++k) {
      const double co =
          std::clamp(moved(move, from, seconds(k - run.begin)), pid.output_low, pid.output_high);
      run.co.push_back(co);
      run.pv.push_back(plant.process_variable());
      plant.step(co);
    }
    return run;
  }

  // Log-likelihood of a test under one sample of an explanation, up to a constant.
  double log_likelihood(const Run& run, const plant::LoopModel& sample, const Blocks& blocks,
                        const ErrorFilter& filter) const {
    plant::LoopModel model = sample;
    model.scenario.set_point = {{0.0, start_.set_point}};
    plant::Plant plant(model, 1);
    plant.reset(run.co.front());
    std::vector<double> error(run.pv.size());
    for (std::size_t k = 0; k < error.size(); ++k) {
      error[k] = run.pv[k] - plant.process_variable();
      plant.step(run.co[k]);
    }
    // The level is a nuisance.
    double mean = 0.0;
    for (std::size_t k = run.begin / 2; k < run.begin; ++k) {
      mean += error[k] / static_cast<double>(run.begin - run.begin / 2);
    }
    for (double& e : error) e -= mean;
    std::vector<double> by_block(blocks.count());
    std::vector<double> white(blocks.count());
    blocks.average(error, by_block);
    filter.whiten(by_block, white);
    double sum = 0.0;
    const std::size_t first = run.begin / 2 / blocks.per_block();
    for (std::size_t b = first; b < white.size(); ++b) sum -= 0.5 * white[b] * white[b];
    return sum;
  }

  const plant::LoopModel& sample_of(std::size_t explanation, std::size_t i) const {
    const auto& samples = explanations_[explanation].samples;
    return samples[i % samples.size()];
  }

  // What `tests` simulated tests of each explanation give.
  Score score(const Move& move, std::size_t tests) const {
    Score out;
    for (std::size_t h = 0; h < explanations_.size(); ++h) {
      for (std::size_t i = 0; i < tests; ++i) {
        const Run run = simulate(sample_of(h, i), move, 1000 * h + i + 1);
        for (std::size_t k = run.begin; k < run.pv.size(); ++k) {
          out.pv_swing = std::max(out.pv_swing, std::abs(run.pv[k] - start_.set_point));
          out.output_swing =
              std::max(out.output_swing, std::abs(run.co[k] - run.co[run.begin - 1]));
        }
        const std::size_t decided = decision(run, h, i);
        const double share = weight_[h] / static_cast<double>(tests);
        if (decided == h) {
          out.right += share;
        } else if (decided < explanations_.size()) {
          out.wrong += share;
        }
      }
    }
    return out;
  }

  // The explanation that reaches kDecides; explanations_.size(): none does.
  std::size_t decision(const Run& run, std::size_t truth, std::size_t test) const {
    const std::size_t per_block =
        block_length(model_.process.time_constant_s, model_.sample_time_s, run.pv.size());
    const Observed observed{model_.sample_time_s, run.co, run.pv,
                            std::vector<bool>(run.pv.size(), true)};
    const Blocks blocks(observed, run.pv.size(), per_block,
                        std::max(start_.noise_rms, kLimits.least_noise * pv_span_));
    std::vector<double> variance = activity(blocks, run.co, model_.process.dead_time_s, answer_s_);
    for (double& v : variance) v *= start_.law_error * start_.law_error;
    const ErrorFilter filter(blocks, {kReturns_s, answer_s_}, start_.disturbance, variance);
    std::vector<double> score;
    for (std::size_t h = 0; h < explanations_.size(); ++h) {
      std::vector<double> all;
      // Not the sample that made the record.
      for (std::size_t i = 0; all.size() < kRivals && i < 2 * kRivals; ++i) {
        const std::size_t rival = test + 1 + i;
        const auto count = explanations_[h].samples.size();
        if (h == truth && count > 1 && rival % count == test % count) continue;
        all.push_back(log_likelihood(run, sample_of(h, rival), blocks, filter));
      }
      const double top = *std::max_element(all.begin(), all.end());
      double sum = 0.0;
      for (const double l : all) sum += std::exp(l - top);
      score.push_back(std::log(weight_[h]) + top + std::log(sum / static_cast<double>(all.size())));
    }
    const double top = *std::max_element(score.begin(), score.end());
    double sum = 0.0;
    for (const double s : score) sum += std::exp(s - top);
    for (std::size_t h = 0; h < score.size(); ++h) {
      if (std::exp(score[h] - top) / sum >= kDecides) return h;
    }
    return explanations_.size();
  }

  TestPlan described(const Move& move, const Score& s, double share) const {
    TestPlan plan{.move = move,
                  .duration_s = duration_s(move),
                  .probability_right = s.right,
                  .probability_wrong = s.wrong,
                  .class_share = share,
                  .pv_swing = s.pv_swing,
                  .output_swing = s.output_swing};
    const std::size_t count = samples(plan.duration_s);
    const double from = in_manual(move.kind) ? start_.output : start_.set_point;
    for (std::size_t k = 0; k < count; ++k) {
      plan.time_s.push_back(seconds(k));
      plan.moved.push_back(moved(move, from, plan.time_s.back()));
    }
    for (std::size_t h = 0; h < explanations_.size(); ++h) {
      std::vector<Run> runs;
      for (std::size_t i = 0; i < kTests; ++i) {
        runs.push_back(simulate(sample_of(h, i), move, 1000 * h + i + 1));
      }
      Predicted band;
      std::vector<double> values(runs.size());
      for (std::size_t k = 0; k < count; ++k) {
        for (std::size_t i = 0; i < runs.size(); ++i) {
          values[i] = runs[i].pv[std::min(runs[i].begin + k, runs[i].pv.size() - 1)];
        }
        band.low.push_back(numeric::quantile(values, 0.05));
        band.middle.push_back(numeric::quantile(values, 0.5));
        band.high.push_back(numeric::quantile(values, 0.95));
      }
      plan.predicted.push_back(std::move(band));
    }
    return plan;
  }

  std::string why_not(const std::optional<TestPlan>& best) const {
    const double most = 100.0 * start_.most_pv_share;
    if (!best) {
      return numeric::text("Every move that was tried moves PV by more than %.3g %% of its span.",
                           most);
    }
    return numeric::text(
        "The best move within %.3g %% of the PV span decides with probability %.2f, less than "
        "%.2g. "
        "%s",
        most, best->probability_right, kWanted,
        start_.disturbance * std::sqrt(answer_s_) > start_.noise_rms
            ? "The disturbance hides the difference."
            : "The explanations predict nearly the same PV.");
  }

  const std::vector<Explanation>& explanations_;
  const TestStart& start_;
  const numeric::ParallelFor& parallel_;
  const plant::LoopModel& model_;
  double pv_span_;   // PV units
  double answer_s_;  // s
  std::vector<double> weight_;
};

}  // namespace

const char* to_text(MoveKind kind) noexcept {
  switch (kind) {
    case MoveKind::set_point_pair: return "set_point_pair";
    case MoveKind::set_point_reversal: return "set_point_reversal";
    case MoveKind::set_point_stairs: return "set_point_stairs";
    case MoveKind::set_point_ramp: return "set_point_ramp";
    case MoveKind::output_pair: return "output_pair";
    case MoveKind::output_reversal: return "output_reversal";
    case MoveKind::output_stairs: return "output_stairs";
    case MoveKind::output_ramp: return "output_ramp";
  }
  return "";
}

std::optional<MoveKind> move_from_text(std::string_view text) noexcept {
  const auto* const kind =
      std::find_if(kKinds.begin(), kKinds.end(), [&](MoveKind k) { return text == to_text(k); });
  return kind == kKinds.end() ? std::nullopt : std::optional(*kind);
}

double duration_s(const Move& move) noexcept {
  switch (move.kind) {
    case MoveKind::set_point_pair:
    case MoveKind::output_pair: return 2.0 * move.hold_s;
    case MoveKind::set_point_stairs:
    case MoveKind::output_stairs: return 2.0 * kStairs * move.hold_s;
    default: return 3.0 * move.hold_s;
  }
}

double moved(const Move& move, double from, double time_s) noexcept {
  constexpr double kRounding = 1e-9;
  const double holds = time_s / move.hold_s + kRounding;
  const double step = std::floor(holds);
  if (!(holds >= 0.0) || time_s >= duration_s(move)) return from;
  double share = 0.0;  // of the size
  switch (move.kind) {
    case MoveKind::set_point_pair:
    case MoveKind::output_pair: share = step < 1.0 ? 1.0 : 0.0; break;
    case MoveKind::set_point_reversal:
    case MoveKind::output_reversal: share = step < 1.0 ? 1.0 : step < 2.0 ? -1.0 : 0.0; break;
    case MoveKind::set_point_stairs:
    case MoveKind::output_stairs:
      share = (kStairs - std::abs(step + 1.0 - kStairs)) / kStairs;
      break;
    case MoveKind::set_point_ramp:
    case MoveKind::output_ramp: share = std::max(0.0, 1.0 - std::abs(holds - 1.0)); break;
  }
  return from + share * move.size;
}

Planned propose_test(const std::vector<Explanation>& explanations, const TestStart& start,
                     const numeric::ParallelFor& parallel) {
  return Planner(explanations, start, parallel).plan();
}

}  // namespace loopwarden::estimator
