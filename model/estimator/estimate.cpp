// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/estimate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "model/effects/catalogue.hpp"
#include "model/estimator/constants.hpp"
#include "model/estimator/flexible.hpp"
#include "model/estimator/slips.hpp"
#include "model/numeric/statistics.hpp"
#include "model/numeric/text.hpp"

namespace loopwarden::estimator {
namespace {

using effects::Block;

constexpr double kEndQuantile = 0.01;      // where the ends of PV are taken
constexpr double kLeastMovement = 0.005;   // of the CO span: a valve that moves less shows nothing
constexpr double kAsGood = 1.15;           // of the least error on the fitted part
constexpr double kEqual = 1.0;             // nats
constexpr double kNearlyAll = 0.8;         // of what is left, for a further effect
constexpr double kVisible = 1.5;           // of the floor: a larger error is a visible gap
constexpr double kSpike = 8.0;             // noise of a sample, beyond what the process can do
constexpr std::size_t kLongestSpike = 12;  // samples
constexpr std::size_t kSamples = 50;       // models of an explanation
constexpr std::size_t kReweighted = 8;     // members that are tried on a later record
constexpr double kLeastEffect = 0.0015;    // of the PV span: a smaller effect does not matter

// Linear dynamics and curves: a model that does not know the process can't lack them.
bool changes_process(const Candidate& c) {
  return c.bends || (c.smooth && (c.block == Block::process || c.block == Block::valve));
}

std::vector<Candidate> catalogue_for(const Observed& observed, const LoopFacts& loop,
                                     const Blocks& blocks, const Options& options) {
  const std::size_t fitted = blocks.samples();
  const plant::LoopModel& model = loop.model;
  const control::PidSettings& pid = model.controller.pid;
  const auto end = observed.co.begin() + static_cast<std::ptrdiff_t>(fitted);
  const auto [low, high] = std::minmax_element(observed.co.begin(), end);
  std::vector<double> pv;
  for (std::size_t k = 0; k < fitted; ++k) {
    if (observed.used[k]) pv.push_back(observed.pv[k]);
  }
  std::vector<Candidate> all =
      effects::candidates({.output_low = pid.output_low,
                           .output_high = pid.output_high,
                           .output_used_low = *low,
                           .output_used_high = *high,
                           .pv_low = numeric::quantile(pv, kEndQuantile),
                           .pv_high = numeric::quantile(pv, 1.0 - kEndQuantile),
                           .period_s = observed.period_s,
                           .duration_s = observed.period_s * static_cast<double>(fitted),
                           .time_constant_s = loop.answer_s - model.process.dead_time_s,
                           .dead_time_s = model.process.dead_time_s});
  const bool still = *high - *low < kLeastMovement * loop.co_span;
  std::erase_if(all, [&](const Candidate& c) {
    const bool plant = c.block == Block::valve || c.block == Block::process;
    return (plant && still) || (c.block == Block::valve && !model.has_valve) ||
           (c.is_level && loop.level_free) || (loop.wide && changes_process(c)) ||
           std::find(options.without.begin(), options.without.end(), c.name) !=
               options.without.end();
  });
  // A faster oscillation is averaged away in the blocks.
  constexpr double kFewestBlocks = 8.0;
  for (Candidate& candidate : all) {
    for (effects::SearchRange& range : candidate.search) {
      if (!range.is_period) continue;
      range.low =
          std::min(std::max(range.low, kFewestBlocks * blocks.period_s()), 0.5 * range.high);
    }
  }
  return all;
}

// Forms of one effect share a line.
void add_probability(std::vector<std::pair<std::vector<std::string>, double>>& posterior,
                     const Hypothesis& hypothesis, double probability) {
  std::vector<std::string> names;
  for (const Law* term : hypothesis.terms()) {
    names.emplace_back(term->named ? term->name : "learned");
  }
  const auto line = std::find_if(posterior.begin(), posterior.end(),
                                 [&](const auto& l) { return l.first == names; });
  if (line != posterior.end()) {
    line->second += probability;
  } else {
    posterior.emplace_back(std::move(names), probability);
  }
}

class Estimator {
 public:
  Estimator(const Observed& observed, const plant::LoopModel& model, const Options& options,
            const numeric::ParallelFor& parallel)
      : loop_(model, options.level_known, options.largest_disturbance),
        fitted_(options.fitted > 0 ? options.fitted : observed.pv.size() * 2 / 3),
        noise_rms_(noise_of(observed, fitted_, model.transmitter.resolution, loop_.pv_span)),
        observed_(without_spikes(observed, fastest_pv() + kSpike * noise_rms_, kLongestSpike)),
        run_(loop_, observed.co),
        slips_(find_slips(observed_, loop_, fitted_, noise_rms_)),
        likelihood_(loop_, run_, observed_, fitted_, noise_rms_, slips_),
        parallel_(parallel) {
    const std::vector<Candidate> catalogue =
        catalogue_for(observed, loop_, likelihood_.blocks(), options);
    const double duration_s = observed.period_s * static_cast<double>(fitted_);
    named_ = options.since ? laws_since(catalogue, duration_s, *options.since)
                           : named_laws(catalogue, duration_s);
    const bool learns = std::find(options.without.begin(), options.without.end(), "learned") ==
                        options.without.end();
    if (learns && !options.since) {
      const auto end = observed.co.begin() + static_cast<std::ptrdiff_t>(fitted_);
      const auto [low, high] = std::minmax_element(observed.co.begin(), end);
      unnamed_ = unnamed_laws(catalogue, duration_s,
                              {.pv_over_co = loop_.pv_span / loop_.co_span,
                               .co_low = loop_.model.has_valve ? *low : 0.0,
                               .co_high = loop_.model.has_valve ? *high : 0.0});
    }
    competition_ =
        compete(likelihood_, named_, slips_, options.most_effects, parallel, options.progress);
  }

  Estimate answer() {
    Estimate out;
    out.noise_rms = noise_rms_;
    out.pv_before = base_run();
    out.before = errors_of(out.pv_before);
    out.adjusted = corrected(within(competition_.none()));
    drop_idle(out.pv_before);
    Fit chosen = judged(out);
    // A single name competes with its own law at other places and times; if no name explains the
    // record, all such laws do.
    const Hypothesis& first = chosen.hypothesis;
    const bool all = !explained(out, chosen);
    if (all || first.terms().size() == 1) {
      std::vector<Law> others = unnamed_;
      if (!all) std::erase_if(others, [&](const Law& l) { return !first.contains(l.name); });
      unnamed_ = std::move(others);
    } else {
      unnamed_.clear();
    }
    if (!unnamed_.empty()) {
      add_laws(competition_, likelihood_, unnamed_, slips_, parallel_);
      drop_idle(out.pv_before);
      chosen = judged(out);
    }
    out.evaluations = competition_.evaluations;
    const std::vector<double> weight = weights(competition_.fits);
    const double unnamed = kLimits.unnamed[!explained(out, chosen) ? 2 : exact(out) ? 0 : 1];
    out.posterior.emplace_back(std::vector<std::string>{"unnamed"}, unnamed);
    for (std::size_t i = 0; i < weight.size(); ++i) {
      out.ranked.push_back(rank(competition_.fits[i], weight[i]));
      add_probability(out.posterior, competition_.fits[i].hypothesis, (1.0 - unnamed) * weight[i]);
    }
    std::stable_sort(out.posterior.begin(), out.posterior.end(),
                     [](const auto& a, const auto& b) { return a.second > b.second; });
    out.explanations = explanations(out, 1.0 - unnamed);
    out.chosen = chosen.hypothesis.title();
    out.chosen_left = out.after;
    const bool names = !chosen.hypothesis.terms().empty();
    if (names) name(out, chosen, weight, 1.0 - unnamed);
    if (!explained(out, chosen)) {
      out.verdict = Verdict::unexplained;
      out.nearest = std::exchange(out.effects, {});
      out.pv_after = out.pv_before;
      out.after = out.before;
    } else if (names) {
      out.verdict = Verdict::missing_effect;
    }
    return out;
  }

  // Only the sizes of the error are searched again; for a simulated record they are given.
  Reweighted reweighted(const Observed& later, double rest_s, std::optional<Drawn> from) const {
    const Observed both = joined(observed_, later, rest_s);
    const std::size_t count = both.pv.size();
    const LoopRun run(loop_, both.co);
    const Slips slips = find_slips(both, loop_, count, noise_rms_);
    const Likelihood likelihood(loop_, run, both, count, noise_rms_, slips);
    Reweighted out;
    std::vector<Fit> fits;
    for (std::size_t h = 0; h < competing_.size(); ++h) {
      const Fit& fit = competing_[h];
      Likelihood::Work work;
      Member best = fit.population.top();
      best.log_likelihood = likelihood.of(fit.hypothesis, best.z, work);
      const auto try_member = [&](const std::vector<double>& z) {
        const double l = likelihood.of(fit.hypothesis, z, work);
        if (l > best.log_likelihood) best = {z, l};
      };
      // The first half are samples of the explanation, from which a test may be simulated.
      const std::vector<Member>& members = fit.population.members;
      const std::size_t step = std::max<std::size_t>(1, members.size() / (2 * kReweighted));
      for (std::size_t i = members.size() / 2; i < members.size(); i += step) {
        try_member(members[i].z);
      }
      if (from && from->explanation == h) {
        std::vector<double> z = samples_[h][from->sample];
        if (fit.hypothesis.jumps()) {
          const std::size_t jitter = fit.hypothesis.layout().jitter;
          z = fit.hypothesis.with_law_slips(std::move(z));
          z[jitter] = fit.population.top().z[jitter];
        }
        try_member(z);
      }
      if (!from) best = with_best_error(likelihood, fit.hypothesis, std::move(best), work);
      Fit& now = fits.emplace_back(Fit{fit.hypothesis, {{best}, 0}, {}, 0.0});
      likelihood.of(now.hypothesis, best.z, work, &now.solution);
      now.score = score_of(now, likelihood);
      out.score.push_back(now.score);
    }
    out.probability = weights(fits);
    return out;
  }

 private:
  // The most that PV can move within a sample if the stem jumps along its whole travel, PV units.
  double fastest_pv() const noexcept {
    const plant::ProcessParameters& p = loop_.model.process;
    const double gain = std::abs(p.gain) * loop_.co_span * loop_.model.sample_time_s;
    if (p.integrating()) return gain;
    return gain / (p.time_constant_s * (loop_.wide ? loop_.time_factor.low : 1.0));
  }

  Errors errors_of(const std::vector<double>& pv) const {
    const auto rms = [&](std::size_t begin, std::size_t end) {
      double sum = 0.0;
      double count = 0.0;
      for (std::size_t k = begin; k < end; ++k) {
        if (!observed_.used[k]) continue;
        sum += (pv[k] - observed_.pv[k]) * (pv[k] - observed_.pv[k]);
        count += 1.0;
      }
      return count > 0.0 ? std::sqrt(sum / count) : 0.0;
    };
    return {rms(0, fitted_), rms(fitted_, observed_.pv.size())};
  }

  std::vector<double> run_of(const Fit& fit) const {
    return likelihood_.simulate(fit.hypothesis, fit.population.top().z, fit.solution,
                                observed_.pv.size());
  }

  // Leaves out hypotheses that do nothing here that matters, or that a simpler effect doesn't do.
  void drop_idle(const std::vector<double>& base) {
    std::erase_if(competition_.fits, [&](const Fit& fit) {
      return !fit.hypothesis.terms().empty() && !tells(fit, base);
    });
  }

  // The chosen hypothesis, with its errors in `out`.
  Fit judged(Estimate& out) const {
    const Fit& chosen = choose();
    out.pv_after = run_of(representative(chosen));
    out.after = errors_of(out.pv_after);
    out.with_slips = out.after.holdout;
    if (chosen.hypothesis.sticking() != Hypothesis::npos) {
      const Slips slips = find_slips(observed_, loop_, observed_.pv.size(), noise_rms_);
      out.with_slips = std::min(
          out.with_slips,
          errors_of(likelihood_.simulate(chosen.hypothesis, chosen.population.top().z,
                                         chosen.solution, observed_.pv.size(), nullptr, &slips))
              .holdout);
    }
    const Flexible flexible = flexible_law(likelihood_, chosen, observed_.pv.size());
    out.flexible = flexible.family;
    out.flexible_lead = flexible.lead;
    out.with_flexible = flexible.pv.empty() ? out.after : errors_of(flexible.pv);
    out.floor = floor_of(chosen, flexible.disturbance);
    out.law_error = law_error_of(chosen, out, flexible.lead);
    out.closed = closed(out.before.holdout, out.after.holdout);
    return chosen;
  }

  // The free run with gain, lag, dead time and level within the uncertainty of the model.
  std::vector<double> run_within(const Fit& fit) const { return run_of(within(fit)); }
  Fit within(Fit fit) const {
    if (loop_.wide) return fit;
    for (Eigen::Index i = fit.hypothesis.changes_gain() ? 1 : 0; i < 4; ++i) {
      const double most = likelihood_.allowed(static_cast<std::size_t>(i)) / kLimits.uncertainty;
      fit.solution.mean(i) = std::clamp(fit.solution.mean(i), -most, most);
    }
    return fit;
  }
  std::vector<double> base_run() const { return run_within(competition_.none()); }

  bool tells(const Fit& fit, const std::vector<double>& base) const {
    const Point point = fit.hypothesis.at(fit.population.top().z);
    const auto solved = fit.solution.solved(fit.hypothesis, likelihood_.fixed());
    constexpr double kLeastTelling = 0.005;  // of the samples
    const std::span<const double> co(observed_.co.data(), fitted_);
    for (std::size_t i = 0; i < fit.hypothesis.terms().size(); ++i) {
      const Law& term = *fit.hypothesis.terms()[i];
      if (term.telling != nullptr &&
          term.telling(point.searched[i], co, observed_.period_s) < kLeastTelling) {
        return false;
      }
      if (term.shows_place != nullptr && !term.shows_place(point.searched[i], co)) return false;
      const effects::Descriptor* info = effects::find_effect(term.name);
      if (info != nullptr && info->more_by != nullptr) {
        const auto parameters = term.effect(point.searched[i], solved[i]).parameters;
        const auto more = parameters.find(info->more_by);
        if (more != parameters.end() && more->second < term.more_from) return false;
      }
    }
    const std::vector<double> pv = run_of(fit);
    double sum = 0.0;
    for (std::size_t k = 0; k < fitted_; ++k) sum += (pv[k] - base[k]) * (pv[k] - base[k]);
    const double least = std::max(kLeastEffect * loop_.pv_span, 0.5 * noise_rms_);
    return sum > least * least * static_cast<double>(fitted_);
  }

  Ranked rank(const Fit& fit, double weight) const {
    Ranked out{.title = fit.hypothesis.title(),
               .named = fit.hypothesis.named(),
               .score = fit.score,
               .log_likelihood = fit.log_likelihood(),
               .weight = weight};
    const Point point = fit.hypothesis.at(fit.population.top().z);
    out.error =
        likelihood_.errors().size_at(likelihood_.errors().index(point.disturbance, point.law));
    const auto solved = fit.solution.solved(fit.hypothesis, likelihood_.fixed());
    for (std::size_t i = 0; i < fit.hypothesis.terms().size(); ++i) {
      const Law& term = *fit.hypothesis.terms()[i];
      out.effects.push_back(term.effect(point.searched[i], solved[i]));
      out.blocks.push_back(term.block);
      for (const auto& [name, value] : out.effects.back().parameters) {
        out.parameters += numeric::text(" %s %.4g", name.c_str(), value);
      }
    }
    out.parameters += numeric::text(" | T %.2f L %.2f", point.time_constant_s, point.dead_time_s);
    out.parameters += numeric::text(
        " K' %.3f lnT %.3f L %.3f level %.3f wn %.1f zeta %.2f f %.3f jit %.2f",
        fit.solution.gain(), fit.solution.mean(1), fit.solution.mean(2), fit.solution.mean(3),
        point.actuator_frequency, point.actuator_damping, point.friction, point.jitter);
    out.left = errors_of(run_of(fit));
    return out;
  }

  // The best score, as long as each further effect is clearly shown.
  const Fit& choose() const {
    const std::vector<Fit>& fits = competition_.fits;
    const Fit* chosen = &competition_.none();
    for (std::size_t effects = 1; effects <= 3; ++effects) {
      const double lead = effects == 1 ? kLimits.first_lead : kLimits.further_lead;
      for (const Fit& fit : fits) {
        if (fit.hypothesis.terms().size() != effects) continue;
        if (!fit.hypothesis.named() && shadows_name(fit)) continue;
        if (fit.score > chosen->score + lead && shown_throughout(fit, *chosen) &&
            more_closed(fit, *chosen)) {
          chosen = &fit;
        }
        break;
      }
    }
    // Of two that fit equally well, the simpler one.
    for (const Fit& fit : fits) {
      if (fit.hypothesis.terms().size() == chosen->hypothesis.terms().size() &&
          fit.hypothesis.named() == chosen->hypothesis.named() &&
          fit.hypothesis.parameters() < chosen->hypothesis.parameters() &&
          fit.score > chosen->score - kEqual) {
        return fit;
      }
    }
    return *chosen;
  }

  // A law without a name counts only if it is clearly better than every name.
  bool shadows_name(const Fit& unnamed) const {
    return std::any_of(competition_.fits.begin(), competition_.fits.end(), [&](const Fit& fit) {
      return fit.hypothesis.named() && fit.hypothesis.terms().size() == 1 &&
             (fit.score > unnamed.score - kLimits.first_lead ||
              lead_t(unnamed, fit) <= kLimits.least_t);
    });
  }

  // The lead of a further effect is not that of one part of the record, unless the effect is: a
  // moment, or a shift, which next to a disturbance shows at the start of the record only.
  static bool shown_throughout(const Fit& more, const Fit& less) {
    if (less.hypothesis.terms().empty()) return true;
    for (const Law* term : more.hypothesis.terms()) {
      if (less.hypothesis.contains(term->name)) continue;
      if (term->at_one_moment || term->shifts_pv) return true;
    }
    return lead_t(more, less) > kLimits.least_t;
  }

  // A further effect closes a share of the gap that matters, or nearly all that is left.
  bool more_closed(const Fit& more, const Fit& less) const {
    if (less.hypothesis.terms().empty()) return true;
    const double a = errors_of(run_of(representative(more))).training;
    const double b = errors_of(run_within(representative(less))).training;
    const double base = errors_of(base_run()).training;
    const double noise = noise_rms_ * noise_rms_;
    return b * b - a * a >= std::min(kLimits.least_share * std::max(0.0, base * base - noise),
                                     kNearlyAll * std::max(0.0, b * b - noise));
  }

  // The law of a fit without slips by PV, searched near its posterior.
  const Fit& representative(const Fit& fit) const {
    return fit.hypothesis.jumps() ? represented(fit).fit : fit;
  }

  struct Represented {
    Fit fit;
    // Of the last third, between members that fit the record as well, PV units rms. A few slips
    // fix the friction only so far.
    double spread = 0.0;
  };
  const Represented& represented(const Fit& fit) const {
    const std::pair key{fit.hypothesis.title(), fit.log_likelihood()};
    const auto known = representatives_.find(key);
    if (known != representatives_.end()) return known->second;
    return representatives_.emplace(key, find_representative(fit)).first->second;
  }

  Represented find_representative(const Fit& fit) const {
    Hypothesis law = fit.hypothesis.law_only();
    Start start = Start::around(fit.population.members, fit.population.best, 1.5, 0.02, 1.0);
    start.mean = fit.hypothesis.without_slips(std::move(start.mean));
    start.deviation = fit.hypothesis.without_slips(std::move(start.deviation));
    Likelihood::Work work;
    Fit out{law, fit.population, {}, fit.score};
    if (fit.hypothesis.at(fit.population.top().z).jitter > 0.0) {
      out.population = search(likelihood_, law, start, {96, 2, 3}, 11, work);
    } else {
      for (Member& m : out.population.members) {
        m.z = fit.hypothesis.without_slips(std::move(m.z));
      }
    }
    std::vector<double> left;
    std::vector<std::vector<double>> runs;
    for (const Member& m : out.population.members) {
      likelihood_.of(law, m.z, work, &out.solution);
      runs.push_back(likelihood_.simulate(law, m.z, out.solution, observed_.pv.size()));
      left.push_back(errors_of(runs.back()).training);
    }
    const double most = kAsGood * *std::min_element(left.begin(), left.end());
    out.population.best =
        law.sticking() != Hypothesis::npos
            ? middle_of(law, out.population.members, left, most)
            : static_cast<std::size_t>(std::min_element(left.begin(), left.end()) - left.begin());
    likelihood_.of(law, out.population.top().z, work, &out.solution);
    const std::vector<double>& shown = runs[out.population.best];
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t m = 0; m < runs.size(); ++m) {
      if (left[m] > most) continue;
      for (std::size_t k = fitted_; k < shown.size(); ++k, ++count) {
        sum += (runs[m][k] - shown[k]) * (runs[m][k] - shown[k]);
      }
    }
    return {std::move(out), count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0.0};
  }

  // Of sticking members that fit the record as well, the one in the middle of their range: friction
  // varies, so it has the largest margin for slips that are not fitted.
  static std::size_t middle_of(const Hypothesis& law, const std::vector<Member>& members,
                               const std::vector<double>& error, double most) {
    const std::size_t own = law.layout().own;
    std::vector<double> low(own, 1.0);
    std::vector<double> high(own, 0.0);
    for (std::size_t m = 0; m < members.size(); ++m) {
      if (error[m] > most) continue;
      for (std::size_t i = 0; i < own; ++i) {
        low[i] = std::min(low[i], members[m].z[i]);
        high[i] = std::max(high[i], members[m].z[i]);
      }
    }
    std::size_t middle = 0;
    double nearest = std::numeric_limits<double>::max();
    for (std::size_t m = 0; m < members.size(); ++m) {
      if (error[m] > most) continue;
      double distance = 0.0;
      for (std::size_t i = 0; i < own; ++i) {
        const double off = members[m].z[i] - 0.5 * (low[i] + high[i]);
        distance += off * off / std::max(1e-12, (high[i] - low[i]) * (high[i] - low[i]));
      }
      if (distance < nearest) {
        nearest = distance;
        middle = m;
      }
    }
    return middle;
  }

  double closed(double before, double after) const {
    const double gap = before * before - noise_rms_ * noise_rms_;
    return gap > 0.0 ? (before * before - after * after) / gap : 0.0;
  }

  // Noise and disturbance of a free run, PV units. A disturbance counts only as far as no law
  // without a name explains it, and not at its upper limit.
  double floor_of(const Fit& fit, double with_flexible) const {
    const double returns_s = std::min(300.0, likelihood_.blocks().duration_s());
    const double own = size_of(fit).disturbance;
    const bool at_limit = own > 0.99 * loop_.largest_disturbance;
    const double disturbance =
        at_limit ? 0.0 : std::min(own, with_flexible) * std::sqrt(0.5 * returns_s);
    return std::hypot(noise_rms_, disturbance);
  }

  // The error of the law itself, PV units: a part of the gap at most. No law of friction is exactly
  // that of a real valve, so the error on the fitted part counts for it, or what the record leaves
  // open on the last third. If a law without a name
  // explains what is left, that is no error of this law but another effect.
  double law_error_of(const Fit& fit, const Estimate& out, double flexible_lead) const {
    const double most = kLimits.law_share * out.before.holdout;
    const Terms& terms = fit.hypothesis.terms();
    const bool friction =
        std::any_of(terms.begin(), terms.end(), [](const Law* t) { return t->friction; });
    if (friction && flexible_lead < kLimits.further_lead) {
      const double spread = fit.hypothesis.jumps() ? represented(fit).spread : 0.0;
      return std::min(std::max(out.after.training, spread), most);
    }
    return std::min(size_of(fit).law, most);
  }

  ErrorSize size_of(const Fit& fit) const {
    const Point point = fit.hypothesis.at(fit.population.top().z);
    return likelihood_.errors().size_at(likelihood_.errors().index(point.disturbance, point.law));
  }

  // Whether the record contradicts the names: they close hardly anything on the fitted part, or
  // less than half of a gap of more than two floors on the last third, or make a smaller one larger
  // by more than the floor.
  bool refuted(const Estimate& out) const {
    const double before = out.before.holdout;
    const double fitted = std::pow(out.before.training, 2.0);
    const double gap = std::max(0.0, fitted - std::pow(kVisible * out.floor, 2.0));
    if (fitted - std::pow(out.after.training, 2.0) < kLimits.least_fitted * gap) return true;
    if (before > 2.0 * out.floor) {
      return closed(before, out.with_slips) < kLimits.least_closed;
    }
    return out.with_slips * out.with_slips > before * before + out.floor * out.floor;
  }

  // Whether a free run leaves no more than `floor` allows.
  bool within(double left, double floor) const {
    return left <= kLimits.floors * floor || left <= kLeastEffect * loop_.pv_span;
  }
  // Whether the chosen law leaves no visible error, as that of the plant itself would.
  bool exact(const Estimate& out) const {
    return out.after.holdout <= kVisible * out.floor ||
           out.after.holdout <= kLeastEffect * loop_.pv_span;
  }
  bool explained(const Estimate& out, const Fit& fit) const {
    if (out.flexible_lead > kLimits.flexible_lead) return false;
    if (fit.hypothesis.terms().empty()) {
      return within(std::max(out.before.training, out.before.holdout), out.floor);
    }
    return within(std::max(out.after.training, out.with_slips),
                  std::hypot(out.floor, out.law_error)) &&
           !refuted(out);
  }

  // `catalogue`: probability that a law of the catalogue is the cause.
  std::vector<Explanation> explanations(const Estimate& out, double catalogue) {
    std::vector<Explanation> all;
    for (const auto& line : out.posterior) {
      const std::vector<std::string>& names = line.first;
      const double probability = line.second;
      const auto fit = std::find_if(
          competition_.fits.begin(), competition_.fits.end(),
          [&](const Fit& f) { return f.hypothesis.named() && f.hypothesis.names() == names; });
      if (probability < kCompetes * catalogue || fit == competition_.fits.end()) continue;
      competing_.push_back(*fit);
      std::vector<std::vector<double>>& from = samples_.emplace_back();
      Explanation& one = all.emplace_back(Explanation{names, probability, {}});
      Fit sample = representative(*fit);
      Likelihood::Work work;
      for (const Member& m : sample.population.members) {
        if (one.samples.size() == kSamples) break;
        likelihood_.of(sample.hypothesis, m.z, work, &sample.solution);
        from.push_back(m.z);
        const Eigen::VectorXd& mean = sample.solution.mean;
        one.samples.push_back(
            run_.corrected(sample.hypothesis, sample.hypothesis.at(m.z),
                           {mean.data(), static_cast<std::size_t>(mean.size())},
                           sample.solution.solved(sample.hypothesis, likelihood_.fixed())));
      }
    }
    return all;
  }

  // When effect `term` began; zeros: always.
  static Interval moment_of(const Fit& fit, std::size_t term) {
    const Law& law = *fit.hypothesis.terms()[term];
    if (law.timing != Law::Timing::since) return {};
    const std::size_t at = fit.hypothesis.first_of(term) + law.coordinates() - 1;
    std::vector<double> moments;
    for (const Member& m : fit.population.members) moments.push_back(law.moment.value(m.z[at]));
    return {law.moment.value(fit.population.top().z[at]),
            {numeric::quantile(moments, 0.025), numeric::quantile(moments, 0.975)}};
  }

  // `catalogue`: probability that a law of the catalogue is the cause.
  void name(Estimate& out, const Fit& chosen, const std::vector<double>& weight,
            double catalogue) const {
    const Fit& shown = representative(chosen);
    const Point point = shown.hypothesis.at(shown.population.top().z);
    const auto solved = shown.solution.solved(shown.hypothesis, likelihood_.fixed());
    const auto ranges = intervals(likelihood_, chosen, shown);
    for (std::size_t i = 0; i < chosen.hypothesis.terms().size(); ++i) {
      const Law& term = *chosen.hypothesis.terms()[i];
      double confidence = 0.0;
      for (std::size_t h = 0; h < weight.size(); ++h) {
        const Hypothesis& other = competition_.fits[h].hypothesis;
        if (other.contains(term.name) && other.named() == term.named) confidence += weight[h];
      }
      Found found{term.effect(point.searched[i], solved[i]),
                  term.block,
                  std::min(catalogue * confidence, kLimits.most_confidence),
                  ranges[i],
                  {},
                  moment_of(shown, i)};
      if (!term.named) {
        found.description = term.description();
        found.spec.name = "learned";
        found.confidence = std::min(found.confidence, kLimits.most_learned);
      }
      if (out.flexible_lead > kLimits.further_lead) {
        found.confidence = std::min(found.confidence, kLimits.most_with_flexible);
      }
      // Only the law's own error explains what is left, or the process is not known.
      if (loop_.wide || !exact(out)) {
        found.confidence = std::min(found.confidence, kLimits.most_inexact);
      }
      out.effects.push_back(std::move(found));
    }
    out.corrected = corrected(shown);
  }

  plant::LoopModel corrected(const Fit& fit) const {
    const Eigen::VectorXd& mean = fit.solution.mean;
    return run_.corrected(fit.hypothesis, fit.hypothesis.at(fit.population.top().z),
                          {mean.data(), static_cast<std::size_t>(mean.size())},
                          fit.solution.solved(fit.hypothesis, likelihood_.fixed()));
  }

  LoopFacts loop_;
  std::size_t fitted_;
  double noise_rms_;
  Observed observed_;
  LoopRun run_;
  Slips slips_;
  Likelihood likelihood_;
  const numeric::ParallelFor& parallel_;
  std::vector<Law> named_;
  std::vector<Law> unnamed_;
  Competition competition_;
  std::vector<Fit> competing_;                             // of the explanations
  std::vector<std::vector<std::vector<double>>> samples_;  // of the explanations: coordinates
  mutable std::map<std::pair<std::string, double>, Represented> representatives_;
};

}  // namespace

const char* to_text(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::no_gap: return "no_gap";
    case Verdict::missing_effect: return "missing_effect";
    case Verdict::unexplained: return "unexplained";
  }
  return "";
}

Estimate estimate(const Observed& observed, const plant::LoopModel& model, const Options& options,
                  const numeric::ParallelFor& parallel) {
  const auto estimator = std::make_shared<Estimator>(observed, model, options, parallel);
  Estimate out = estimator->answer();
  out.reweighted = [estimator](const Observed& later, double rest_s, std::optional<Drawn> from) {
    return estimator->reweighted(later, rest_s, from);
  };
  return out;
}

}  // namespace loopwarden::estimator
