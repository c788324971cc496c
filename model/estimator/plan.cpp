// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/plan.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "model/estimator/test_evidence.hpp"
#include "model/numeric/statistics.hpp"
#include "model/numeric/text.hpp"
#include "model/plant/simulated_loop.hpp"

namespace loopwarden::estimator {
namespace {

constexpr std::array<double, 3> kClasses{0.01, 0.03, 0.05};  // of the span of PV
// Of a span. The last ones are larger than a test may be; they show from which size one would do.
constexpr std::array<double, 10> kSizes{0.0025, 0.005, 0.01, 0.015, 0.02,
                                        0.03,   0.05,  0.08, 0.12,  0.2};
constexpr std::size_t kAllowedSizes = 7;
constexpr std::array<double, 3> kHolds{3.0, 8.0, 20.0};  // answer times
constexpr double kWorthTrying = 0.5;                     // without a test that reaches kWanted
constexpr double kWarmUp = 20.0;                         // answer times before the move
constexpr std::size_t kRivals = 4;                       // samples that judge a simulated test
constexpr std::size_t kFirstTests = 5;                   // of each explanation
constexpr std::size_t kTests = 50;
constexpr double kFirstError = 0.1;      // of the share of right decisions after the first tests
constexpr double kMostLead = 10.0;       // nats: a clearer test is not better. By hand
constexpr double kClearLead = 8.0;       // nats, mean: larger moves tell no more. By hand
constexpr std::size_t kJudged = 10;      // of each explanation, if the estimator judges them
constexpr std::size_t kMostFailing = 2;  // most telling moves of a class that are judged in vain
constexpr std::size_t kMostBeyond = 3;   // the same outside the limits
constexpr double kReturns_s = 300.0;
constexpr double kNextGain = 0.02;  // more right decisions that make the next class worth naming
constexpr double kStairs = 3.0;
constexpr std::array kKinds{MoveKind::set_point_pair,   MoveKind::set_point_reversal,
                            MoveKind::set_point_stairs, MoveKind::set_point_ramp,
                            MoveKind::output_pair,      MoveKind::output_reversal,
                            MoveKind::output_stairs,    MoveKind::output_ramp};

// A sample of an explanation under the CO of a test.
struct Rival {
  plant::Plant plant;
  std::vector<double> error;  // PV of the test less its own, PV units
};

// A simulated loop before the move: what happened so far, and how its rivals explain it. The first
// half is forgotten.
struct Warm {
  plant::SimulatedLoop loop;
  std::vector<double> co, pv;
  std::vector<std::vector<Rival>> rivals;  // by explanation
};

// The test itself.
struct Run {
  std::vector<double> co, pv;
};

struct Score {
  double right = 0.0;
  double wrong = 0.0;
  double lead = 0.0;  // nats, mean: of the simulated explanation over the others, by samples
  double pv_swing = 0.0;
  double output_swing = 0.0;
};

struct Tried {
  Move move;
  Score first;                 // after the first tests
  std::optional<Score> all{};  // after all tests
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
    warm_.resize(explanations_.size() * kTests);
    parallel_(warm_.size(), [&](std::size_t i) { warm_[i] = warmed(i / kTests, i % kTests); });
    for (const auto& warm : warm_) {
      for (const double pv : warm->pv) {
        idle_swing_ = std::max(idle_swing_, std::abs(pv - start_.set_point));
      }
    }
  }

  Planned plan() {
    Planned out;
    std::vector<Tried> tried = try_moves(0, kAllowedSizes);
    for (const double share : kClasses) {
      if (share > start_.most_pv_share + 1e-9) break;
      const Tried* best = cheapest(tried, share, out.plan ? 1.0 : kWanted);
      if (best == nullptr) continue;
      const double right = best->all->right;
      if (out.plan) {
        if (right > out.plan->probability_right + kNextGain) out.next = described(*best, share);
        break;
      }
      if (right >= kWanted) {
        out.plan = described(*best, share);
      } else if (!out.best || right > out.best->probability_right + kNextGain) {
        out.best = described(*best, share);
      }
    }
    if (!out.plan && out.best && worth_trying(*out.best)) out.plan = std::exchange(out.best, {});
    if (!out.plan) explain_refusal(tried, out);
    return out;
  }

 private:
  // A move within the limits of SP or output.
  std::optional<Move> move_of(MoveKind kind, double size, double hold) const {
    const bool manual = in_manual(kind);
    Move move{kind, size * (manual ? model_.controller.pid.output_span() : pv_span_),
              hold * answer_s_};
    const auto& limits = manual ? start_.outputs : start_.set_points;
    const double at = manual ? start_.output : start_.set_point;
    if (at + move.size > limits[1]) move.size = -move.size;
    if (!within(move, at, limits) || duration_s(move) > start_.longest_s) return std::nullopt;
    return move;
  }

  static bool within(const Move& move, double from, const std::array<double, 2>& limits) {
    for (double part = 0.0; part < 1.0; part += 0.01) {
      const double at = moved(move, from, part * duration_s(move));
      if (at < limits[0] || at > limits[1]) return false;
    }
    return true;
  }

  // The first tests of moves with sizes `from` to `to` of kSizes. A kind of move ends at the
  // largest class, or where larger ones tell no more.
  std::vector<Tried> try_moves(std::size_t from, std::size_t to) const {
    std::vector<std::vector<Tried>> by(kKinds.size() * kHolds.size());
    parallel_(by.size(), [&](std::size_t i) {
      for (std::size_t size = from; size < to; ++size) {
        const std::optional<Move> move =
            move_of(kKinds[i / kHolds.size()], kSizes[size], kHolds[i % kHolds.size()]);
        if (!move) continue;
        const Score s = score(*move, kFirstTests);
        by[i].push_back({*move, s});
        if (to == kAllowedSizes && added(s) > start_.most_pv_share) break;
        if (s.lead >= kClearLead) break;
      }
    });
    std::vector<Tried> all;
    for (const auto& one : by) all.insert(all.end(), one.begin(), one.end());
    return all;
  }

  // The cheapest move whose PV stays within `share` of the span and that decides with probability
  // `wanted`; otherwise the one that decides most often. In automatic first.
  const Tried* cheapest(std::vector<Tried>& tried, double share, double wanted) const {
    const Tried* best = nullptr;
    for (const bool manual : {false, true}) {
      const std::vector<Tried*> moves = front(tried, share, manual);
      const auto judge = [&](Tried& t) {
        if (!t.all) t.all = judged(t.move);
        if (added(*t.all) > share) return false;
        if (best == nullptr || t.all->right > best->all->right) best = &t;
        return t.all->right >= wanted;
      };
      std::size_t end = moves.size();  // moves from here on are larger than needed
      const std::size_t failing = moves.size() - std::min(moves.size(), kMostFailing);
      while (end > failing && !judge(*moves[end - 1])) --end;
      if (end == failing) continue;
      --end;
      for (std::size_t begin = 0; begin < end;) {
        const std::size_t middle = (begin + end) / 2;
        if (judge(*moves[middle])) {
          end = middle;
        } else {
          begin = middle + 1;
        }
      }
      return moves[end];
    }
    return best;
  }

  // It decides more often than not, and nearly always rightly.
  static bool worth_trying(const TestPlan& plan) {
    const double decides = plan.probability_right + plan.probability_wrong;
    return plan.probability_right >= kWorthTrying && plan.probability_right >= kDecides * decides;
  }

  // The moves of a class, from cheap to dear, of which each tells more than all before it.
  std::vector<Tried*> front(std::vector<Tried>& tried, double share, bool manual) const {
    std::vector<Tried*> moves;
    for (Tried& t : tried) {
      if (in_manual(t.move.kind) == manual && added(t.first) <= share) moves.push_back(&t);
    }
    std::stable_sort(moves.begin(), moves.end(),
                     [&](const Tried* a, const Tried* b) { return cost(*a) < cost(*b); });
    double most = -kMostLead;  // nats
    std::erase_if(moves, [&](const Tried* t) {
      if (t->first.lead <= most) return true;
      most = t->first.lead;
      return false;
    });
    return moves;
  }

  // Deviation that the move adds to those without a move, of the span of PV.
  double added(const Score& s) const { return (s.pv_swing - idle_swing_) / pv_span_; }

  double cost(const Tried& t) const {
    return std::max(0.0, added(t.first)) + 0.01 * duration_s(t.move) / start_.longest_s;
  }

  // Why no test decides, and a larger one that would.
  void explain_refusal(const std::vector<Tried>& tried, Planned& out) const {
    std::vector<Tried> larger = tried;
    for (const Tried& t : try_moves(kAllowedSizes, kSizes.size())) larger.push_back(t);
    const double most = 100.0 * start_.most_pv_share;
    std::erase_if(larger, [&](const Tried& t) {
      return t.first.right < kWanted - kFirstError || 100.0 * added(t.first) <= most;
    });
    std::stable_sort(larger.begin(), larger.end(), [&](const Tried& a, const Tried& b) {
      return a.first.pv_swing < b.first.pv_swing;
    });
    larger.resize(std::min(larger.size(), kMostBeyond));
    for (Tried& t : larger) {
      if (!t.all) t.all = judged(t.move);
      if (t.all->right < kWanted) continue;
      out.beyond = described(t, added(*t.all));
      break;
    }
    const Move shortest{MoveKind::set_point_pair, 1.0, kHolds[0] * answer_s_};
    if (out.best) {
      out.why_not = numeric::text(
          "The best move within %.3g %% of the PV span decides rightly with probability %.2f and "
          "wrongly with %.2f. %s",
          most, out.best->probability_right, out.best->probability_wrong, hides(tried));
    } else if (duration_s(shortest) > start_.longest_s) {
      out.why_not = numeric::text(
          "The loop is too slow: the shortest move takes %.3g s, and a test at most %.3g s.",
          duration_s(shortest), start_.longest_s);
    } else {
      out.why_not = numeric::text(
          "Every move that was tried adds more than %.3g %% of the span to the deviations of PV.",
          most);
    }
    if (out.beyond) {
      const Move& move = out.beyond->move;
      out.why_not += numeric::text(
          " Outside these limits, a move of %s by %.3g would decide; it moves PV by %.3g %% "
          "of its span.",
          in_manual(move.kind) ? "the output" : "SP", std::abs(move.size),
          100.0 * out.beyond->class_share);
    }
  }

  // The reason, by the largest moves without the disturbance.
  const char* hides(std::vector<Tried> tried) const {
    constexpr const char* kSmall =
        "The explanations predict nearly the same PV, because the effect is small.";
    if (!(start_.disturbance > 0.0)) return kSmall;
    std::erase_if(tried, [&](const Tried& t) { return added(t.first) > start_.most_pv_share; });
    std::stable_sort(tried.begin(), tried.end(), [](const Tried& a, const Tried& b) {
      return a.first.pv_swing > b.first.pv_swing;
    });
    tried.resize(std::min(tried.size(), kMostFailing));
    TestStart calm = start_;
    calm.disturbance = 0.0;
    const Planner without(explanations_, calm, parallel_);
    const bool decides = std::any_of(tried.begin(), tried.end(), [&](const Tried& t) {
      return without.score(t.move, kTests).right >= kWanted;
    });
    return decides ? "The disturbance hides the difference." : kSmall;
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
  const plant::LoopModel& sample_of(std::size_t explanation, std::size_t i) const {
    const auto& samples = explanations_[explanation].samples;
    return samples[i % samples.size()];
  }

  std::shared_ptr<const Warm> warmed(std::size_t truth, std::size_t test) const {
    auto warm = std::make_shared<Warm>(
        Warm{plant::SimulatedLoop(measured(sample_of(truth, test), 1000 * truth + test + 1)),
             {},
             {},
             {}});
    const std::size_t count = samples(warm_up_s());
    std::vector<double> co(count);
    std::vector<double> pv(count);
    for (std::size_t k = 0; k < count; ++k) {
      const plant::LoopSample s = warm->loop.step();
      co[k] = s.co;
      pv[k] = s.pv;
    }
    const std::size_t kept = count / 2;
    for (std::size_t h = 0; h < explanations_.size(); ++h) {
      std::vector<Rival>& rivals = warm->rivals.emplace_back();
      const std::size_t available = explanations_[h].samples.size();
      // Not the sample that made the record.
      for (std::size_t i = 0; rivals.size() < kRivals && i < 2 * kRivals; ++i) {
        const std::size_t index = test + 1 + i;
        if (h == truth && available > 1 && index % available == test % available) continue;
        plant::LoopModel model = sample_of(h, index);
        model.scenario.set_point = {{0.0, start_.set_point}};
        Rival rival{plant::Plant(model, 1), {}};
        rival.plant.reset(co.front());
        for (std::size_t k = 0; k < count; ++k) {
          if (k >= kept) rival.error.push_back(pv[k] - rival.plant.process_variable());
          rival.plant.step(co[k]);
        }
        rivals.push_back(std::move(rival));
      }
    }
    warm->co.assign(co.begin() + static_cast<std::ptrdiff_t>(kept), co.end());
    warm->pv.assign(pv.begin() + static_cast<std::ptrdiff_t>(kept), pv.end());
    return warm;
  }

  Run simulate(const Warm& warm, const Move& move) const {
    plant::SimulatedLoop loop = warm.loop;
    Run run;
    const std::size_t count = samples(duration_s(move));
    if (!in_manual(move.kind)) {
      for (std::size_t k = 0; k < count; ++k) {
        loop.controller().request_set_point(moved(move, start_.set_point, seconds(k)));
        const plant::LoopSample s = loop.step();
        run.co.push_back(s.co);
        run.pv.push_back(s.pv);
      }
      return run;
    }
    plant::Plant plant = loop.plant();
    const control::PidSettings& pid = model_.controller.pid;
    for (std::size_t k = 0; k < count; ++k) {
      const double co =
          std::clamp(moved(move, warm.co.back(), seconds(k)), pid.output_low, pid.output_high);
      run.co.push_back(co);
      run.pv.push_back(plant.process_variable());
      plant.step(co);
    }
    return run;
  }

  // Results of `tests` simulated tests of each explanation, judged by samples.
  Score score(const Move& move, std::size_t tests) const {
    Score out;
    for (std::size_t i = 0; i < explanations_.size() * tests; ++i) {
      const std::size_t truth = i / tests;
      const Warm& warm = *warm_[truth * kTests + i % tests];
      const Run run = simulate(warm, move);
      add_swing(warm, run, out);
      const double share = weight_[truth] / static_cast<double>(tests);
      const std::vector<double> probability = by_samples(warm, run);
      const double p = probability[truth];
      out.lead += share * std::clamp(std::log(p / (1.0 - p)), -kMostLead, kMostLead);
      add_decision(decision(probability), truth, share, out);
    }
    return out;
  }

  // Results of all tests. The estimator judges fewer, because each takes longer.
  Score judged(const Move& move) const {
    if (!start_.judge) return score(move, kTests);
    std::vector<std::size_t> decided(explanations_.size() * kTests);
    std::vector<Score> swing(decided.size());
    parallel_(decided.size(), [&](std::size_t i) {
      const Warm& warm = *warm_[i];
      const Run run = simulate(warm, move);
      add_swing(warm, run, swing[i]);
      if (i % kTests >= kJudged) return;
      Observed test{model_.sample_time_s, warm.co, warm.pv, {}};
      test.co.insert(test.co.end(), run.co.begin(), run.co.end());
      test.pv.insert(test.pv.end(), run.pv.begin(), run.pv.end());
      test.used.assign(test.pv.size(), true);
      const std::size_t truth = i / kTests;
      const std::size_t sample = i % kTests % explanations_[truth].samples.size();
      decided[i] = decision(start_.judge(test, {truth, sample}));
    });
    Score out;
    for (std::size_t i = 0; i < decided.size(); ++i) {
      out.pv_swing = std::max(out.pv_swing, swing[i].pv_swing);
      out.output_swing = std::max(out.output_swing, swing[i].output_swing);
      const std::size_t truth = i / kTests;
      if (i % kTests < kJudged) add_decision(decided[i], truth, weight_[truth] / kJudged, out);
    }
    return out;
  }

  void add_swing(const Warm& warm, const Run& run, Score& out) const {
    for (std::size_t k = 0; k < run.pv.size(); ++k) {
      out.pv_swing = std::max(out.pv_swing, std::abs(run.pv[k] - start_.set_point));
      out.output_swing = std::max(out.output_swing, std::abs(run.co[k] - warm.co.back()));
    }
  }
  void add_decision(std::size_t decided, std::size_t truth, double share, Score& out) const {
    if (decided == explanations_.size()) return;
    (decided == truth ? out.right : out.wrong) += share;
  }

  // The explanation that reaches kDecides; explanations_.size(): none does.
  std::size_t decision(const std::vector<double>& probability) const {
    for (std::size_t h = 0; h < probability.size(); ++h) {
      if (probability[h] >= kDecides) return h;
    }
    return explanations_.size();
  }

  // The probability of each explanation.
  std::vector<double> by_samples(const Warm& warm, const Run& run) const {
    std::vector<double> co = warm.co;
    co.insert(co.end(), run.co.begin(), run.co.end());
    const TestEvidence evidence(model_, co, warm.co.size(), start_.noise_rms, start_.disturbance,
                                start_.law_error);
    std::vector<double> score;
    for (std::size_t h = 0; h < explanations_.size(); ++h) {
      std::vector<double> of_samples;
      for (const Rival& rival : warm.rivals[h]) {
        plant::Plant plant = rival.plant;
        std::vector<double> error = rival.error;
        for (std::size_t k = 0; k < run.co.size(); ++k) {
          error.push_back(run.pv[k] - plant.process_variable());
          plant.step(run.co[k]);
        }
        of_samples.push_back(evidence.log_likelihood(std::move(error)));
      }
      score.push_back(std::log(weight_[h]) + log_mean(of_samples));
    }
    const double all = log_mean(score) + std::log(static_cast<double>(score.size()));
    for (double& v : score) v = std::exp(v - all);
    return score;
  }

  TestPlan described(const Tried& tried, double share) const {
    const Move& move = tried.move;
    const Score& s = *tried.all;
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
        runs.push_back(simulate(*warm_[h * kTests + i], move));
      }
      Predicted band;
      std::vector<double> values(runs.size());
      for (std::size_t k = 0; k < count; ++k) {
        for (std::size_t i = 0; i < runs.size(); ++i) values[i] = runs[i].pv[k];
        band.low.push_back(numeric::quantile(values, 0.05));
        band.middle.push_back(numeric::quantile(values, 0.5));
        band.high.push_back(numeric::quantile(values, 0.95));
      }
      plan.predicted.push_back(std::move(band));
    }
    return plan;
  }

  const std::vector<Explanation>& explanations_;
  const TestStart& start_;
  const numeric::ParallelFor& parallel_;
  const plant::LoopModel& model_;
  double pv_span_;           // PV units
  double answer_s_;          // s
  double idle_swing_ = 0.0;  // PV units, without a move
  std::vector<double> weight_;
  std::vector<std::shared_ptr<const Warm>> warm_;  // kTests of each explanation
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
