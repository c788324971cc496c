// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/competition.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>

#include "model/estimator/constants.hpp"
#include "model/estimator/starts.hpp"
#include "model/numeric/random.hpp"

namespace loopwarden::estimator {
namespace {

constexpr std::size_t kPolished = 7;  // singles that are searched again
constexpr std::size_t kParents = 5;   // singles from which pairs grow
constexpr std::size_t kChildren = 5;  // pairs of each that are searched
constexpr std::size_t kByLaw = 2;     // sticking hypotheses that are searched by law
constexpr std::size_t kScanned = 14;  // values of a parameter in a scan
constexpr double kParentLead = 8.0;   // nats above the model
constexpr double kChildLead = 3.0;    // nats above the parent, at the first tries

// The same number for the same names, on every machine.
std::uint64_t seed_of(const Hypothesis& hypothesis, std::uint64_t stage) {
  std::uint64_t hash = 1469598103934665603ULL + stage;
  for (const Law* term : hypothesis.terms()) {
    for (const char* c = term->name; *c != '\0'; ++c) {
      hash = (hash ^ static_cast<std::uint64_t>(static_cast<unsigned char>(*c))) * 1099511628211ULL;
    }
    hash = (hash ^ term->coordinates()) * 1099511628211ULL;
  }
  return hash;
}

Effort effort_of(const Hypothesis& hypothesis) {
  std::size_t own = 0;
  bool moment = false;
  for (const Law* term : hypothesis.terms()) {
    own += term->coordinates();
    moment = moment || (term->columns > 0 && !term->search.empty());
  }
  const bool hard = hypothesis.jumps() || own > 2 || (moment && own > 1);
  const std::size_t members = hypothesis.sticking() != Hypothesis::npos ? kLimits.jumping_members
                              : own > 3                                 ? 3 * kLimits.members
                              : hard                                    ? 3 * kLimits.members / 2
                                                                        : kLimits.members;
  // Two more coordinates, in which the likelihood has several maxima.
  if (hypothesis.wide()) return {.members = 2 * members, .moves = 2, .first = 10};
  return {.members = members,
          .moves = own > 3 ? 2 : 1,
          .first = moment || own > 3 ? std::size_t{6} : std::size_t{4}};
}

class Competitors {
 public:
  Competitors(const Likelihood& likelihood, const std::vector<Law>& catalogue, const Slips& slips,
              const numeric::ParallelFor& parallel, Competition start,
              const std::function<void(double)>& progress)
      : likelihood_(likelihood),
        catalogue_(catalogue),
        slips_(slips),
        parallel_(parallel),
        progress_(progress),
        out_(std::move(start)) {}

  Competition add() {
    add_singles();
    search_again(2, 400.0, 1);
    return std::move(out_);
  }

  Competition run(std::size_t most_effects) {
    add_none();
    say(0.1);
    add_singles();
    say(0.45);
    search_again(kPolished, 400.0, 1);
    stick_from_others();
    stick_by_law(1);
    say(0.7);
    for (std::size_t effects = 2; effects <= most_effects; ++effects) {
      if (!grow(effects)) break;
      // Two changes at one moment: the first search of a pair is far from its best.
      const bool since = !catalogue_.empty() && catalogue_.front().timing == Law::Timing::since;
      search_again(4, since ? 200.0 : 60.0, effects);
      stick_by_law(effects);
      step_back();
      say(1.0 - 0.3 / static_cast<double>(effects));
    }
    return std::move(out_);
  }

 private:
  void say(double done) const {
    if (progress_) progress_(done);
  }

  struct Task {
    Hypothesis hypothesis;
    Start start;
    Effort effort;
    std::uint64_t stage;
    bool by_law = false;  // searched with every slip by its law
  };

  // Searches all tasks; a hypothesis that is there already keeps its better fit.
  void search_all(const std::vector<Task>& tasks) {
    std::vector<std::optional<Fit>> found(tasks.size());
    std::vector<std::size_t> evaluations(tasks.size(), 0);
    parallel_(tasks.size(), [&](std::size_t i) {
      const Task& task = tasks[i];
      Likelihood::Work work;
      const std::uint64_t seed = seed_of(task.hypothesis, task.stage);
      Population population =
          task.by_law ? search_by_law(task, seed, work)
                      : search(likelihood_, task.hypothesis, task.start, task.effort, seed, work);
      Fit fit{task.hypothesis, std::move(population), {}, 0.0};
      likelihood_.of(fit.hypothesis, fit.population.top().z, work, &fit.solution);
      fit.score = score_of(fit, likelihood_);
      found[i] = std::move(fit);
      evaluations[i] = work.evaluations;
    });
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      out_.evaluations += evaluations[i];
      take(std::move(*found[i]));
    }
    std::stable_sort(out_.fits.begin(), out_.fits.end(),
                     [](const Fit& a, const Fit& b) { return a.score > b.score; });
  }

  Population search_by_law(const Task& task, std::uint64_t seed, Likelihood::Work& work) const {
    Start start = task.start;
    start.mean = task.hypothesis.without_slips(std::move(start.mean));
    start.deviation = task.hypothesis.without_slips(std::move(start.deviation));
    Population found =
        search(likelihood_, task.hypothesis.law_only(), start, task.effort, seed, work);
    for (Member& member : found.members) {
      member.z = task.hypothesis.with_law_slips(std::move(member.z));
    }
    return found;
  }

  void take(Fit fit) {
    for (Fit& other : out_.fits) {
      if (other.hypothesis.terms() != fit.hypothesis.terms()) continue;
      if (fit.log_likelihood() > other.log_likelihood()) other = std::move(fit);
      return;
    }
    out_.fits.push_back(std::move(fit));
  }

  void add_none() {
    Hypothesis none(likelihood_.loop(), {});
    search_all({{none, {}, {.members = 64, .moves = 2, .first = 8, .climbs = 100}, 0}});
  }

  // Coordinates of `child` that `parent` has too, at their places in `child`.
  static std::vector<std::pair<std::size_t, std::size_t>> shared(const Hypothesis& parent,
                                                                 const Hypothesis& child) {
    std::vector<std::pair<std::size_t, std::size_t>> out;  // of the parent, of the child
    for (std::size_t i = 0; i < child.terms().size(); ++i) {
      for (std::size_t j = 0; j < parent.terms().size(); ++j) {
        if (child.terms()[i] != parent.terms()[j]) continue;
        for (std::size_t k = 0; k < child.terms()[i]->coordinates(); ++k) {
          out.emplace_back(parent.first_of(j) + k, child.first_of(i) + k);
        }
      }
    }
    const Layout& a = parent.layout();
    const Layout& b = child.layout();
    const auto add = [&](std::size_t from, std::size_t to, std::size_t count) {
      for (std::size_t i = 0; i < count; ++i) out.emplace_back(from + i, to + i);
    };
    if (parent.wide()) add(a.process, b.process, 2);
    if (parent.has_valve()) add(a.actuator, b.actuator, 3);
    if (parent.jumps() && child.jumps()) add(a.jitter, b.jitter, 1);
    add(a.error, b.error, 2);
    return out;
  }

  // Where to search `child`: what it shares with `parent` near its posterior, the rest anywhere.
  Start from_parent(const Fit& parent, const Hypothesis& child, double share) const {
    const Start of =
        Start::around(parent.population.members, parent.population.best, 2.5, 0.03, share);
    Start out{std::vector<double>(child.layout().size, 0.5),
              std::vector<double>(child.layout().size, 4.0), share};
    for (const auto& [from, to] : shared(parent.hypothesis, child)) {
      out.mean[to] = of.mean[from];
      out.deviation[to] = of.deviation[from];
    }
    out.deviation[child.layout().error] = out.deviation[child.layout().error + 1] = 0.3;
    start_together(parent, child, out);
    return out;
  }

  // A further change is looked for at the moment of the first one.
  static void start_together(const Fit& parent, const Hypothesis& child, Start& start) {
    const auto moment_of = [](const Hypothesis& h, std::size_t term) -> std::optional<std::size_t> {
      const Law& law = *h.terms()[term];
      if (law.timing != Law::Timing::since) return std::nullopt;
      return h.first_of(term) + law.coordinates() - 1;
    };
    for (std::size_t j = 0; j < parent.hypothesis.terms().size(); ++j) {
      const auto from = moment_of(parent.hypothesis, j);
      if (!from) continue;
      for (std::size_t i = 0; i < child.terms().size(); ++i) {
        const auto to = moment_of(child, i);
        if (!to || child.terms()[i] == parent.hypothesis.terms()[j]) continue;
        start.mean[*to] = parent.population.top().z[*from];
        start.deviation[*to] = 0.05;
      }
      return;
    }
  }

  // Error of a fit over blocks, PV units: what a further disturbance would have to explain.
  std::vector<double> error_of(const Fit& fit) const {
    const Blocks& blocks = likelihood_.blocks();
    Solution within = fit.solution;
    // Gain and level within what the model allows: otherwise they hide a disturbance.
    if (!fit.hypothesis.changes_gain()) {
      within.mean(0) =
          std::clamp(within.mean(0), -1.6 * likelihood_.allowed(0), 1.6 * likelihood_.allowed(0));
    }
    const std::vector<double> pv =
        likelihood_.simulate(fit.hypothesis, fit.population.top().z, within, blocks.samples());
    std::vector<double> error(blocks.count());
    blocks.average(pv, error);
    for (std::size_t b = 0; b < error.size(); ++b) error[b] = blocks.pv()[b] - error[b];
    return error;
  }

  // The filter of the error at a start.
  const ErrorFilter* filter_of(const Hypothesis& hypothesis, const Start& start) const {
    const Point point = hypothesis.at(start.mean);
    const ErrorGrid& errors = likelihood_.errors();
    return &errors.at(errors.index(point.disturbance, point.law));
  }

  // Puts the statistics of the record into the start of effect `term`.
  void use_statistics(const Hypothesis& hypothesis, std::size_t term, std::span<const double> error,
                      Start& start) const {
    const Law& candidate = *hypothesis.terms()[term];
    const std::size_t first = hypothesis.first_of(term);
    // Before its moment a change has no error, and the rest is slow.
    const bool since = candidate.timing == Law::Timing::since;
    if (const auto found = scan(candidate, likelihood_.blocks(), error,
                                since ? filter_of(hypothesis, start) : nullptr)) {
      for (std::size_t i = 0; i < found->size(); ++i) {
        start.mean[first + i] = (*found)[i];
        start.deviation[first + i] = i == 0 ? 0.015 : 0.06;
        if (candidate.search[i].is_period) {
          // A quarter of a line of the spectrum.
          const effects::SearchRange& range = candidate.search[i];
          start.deviation[first + i] = 0.25 * range.value((*found)[i]) /
                                       likelihood_.blocks().duration_s() /
                                       std::log(range.high / range.low);
        }
      }
    }
    if (const auto found = sticking_start(candidate, slips_)) {
      start.mean[first] = (*found)[0];
      start.deviation[first] = 0.03;
      start.mean[first + 1] = (*found)[1];
      start.deviation[first + 1] = 0.1;
    }
  }

  // A valve law with two parameters of its own is scanned over both: the likelihood of a drive with
  // a band has several maxima, and few members find only one of them.
  void scan_two(const Hypothesis& hypothesis, Start& start) const {
    const Law& law = *hypothesis.terms()[0];
    const auto own = std::count_if(law.search.begin(), law.search.end(), [](const auto& range) {
      return std::string_view(range.name) != effects::kStart.name;
    });
    if (law.block != effects::Block::valve || law.smooth || law.slips || law.columns > 0 ||
        own != 2) {
      return;
    }
    Likelihood::Work work;
    std::vector<double> z = start.mean;
    std::vector<double> best = z;
    double highest = std::numeric_limits<double>::lowest();
    for (std::size_t i = 0; i < kScanned * kScanned; ++i) {
      z[0] = Hypothesis::middle(i / kScanned, kScanned);
      z[1] = Hypothesis::middle(i % kScanned, kScanned);
      const double l = likelihood_.of(hypothesis, z, work);
      if (l > highest) {
        highest = l;
        best = z;
      }
    }
    start.mean = best;
    start.deviation[0] = start.deviation[1] = 1.0 / static_cast<double>(kScanned);
  }

  void add_singles() {
    const Fit none = out_.none();
    const std::vector<double> error = error_of(none);
    std::vector<Task> tasks;
    for (const Law& candidate : catalogue_) {
      Hypothesis one(likelihood_.loop(), {&candidate});
      Start start = from_parent(none, one, 0.7);
      use_statistics(one, 0, error, start);
      const Effort effort = effort_of(one);
      tasks.push_back({std::move(one), std::move(start), effort, 1});
    }
    parallel_(tasks.size(), [&](std::size_t i) { scan_two(tasks[i].hypothesis, tasks[i].start); });
    search_all(tasks);
  }

  // The best `most` hypotheses with so many effects, from their own posterior.
  void search_again(std::size_t most, double within, std::size_t effects) {
    std::vector<Task> tasks;
    for (const Fit& fit : out_.fits) {
      if (tasks.size() >= most || fit.score < out_.fits.front().score - within) break;
      if (fit.hypothesis.terms().size() != effects) continue;
      Start start = Start::around(fit.population.members, fit.population.best, 2.5, 0.02, 0.8);
      const Layout& layout = fit.hypothesis.layout();
      if (fit.hypothesis.has_valve()) {
        for (std::size_t i = 0; i < 3; ++i) {
          start.deviation[layout.actuator + i] =
              std::max(start.deviation[layout.actuator + i], 0.3);
        }
      }
      const bool sticks = fit.hypothesis.sticking() != Hypothesis::npos;
      const std::size_t members = sticks ? 128 : fit.hypothesis.jumps() ? 96 : 64;
      tasks.push_back({fit.hypothesis,
                       std::move(start),
                       {members, 2, 2, sticks ? std::size_t{200} : std::size_t{80}},
                       10 + fit.hypothesis.terms().size()});
    }
    search_all(tasks);
  }

  // Searches stiction where laws that are nearly the same fit better: backlash, which is stiction
  // with a small jump, and stiction of a part of the record.
  void stick_from_others() {
    const auto sticks = std::find_if(catalogue_.begin(), catalogue_.end(),
                                     [](const Law& law) { return law.slips; });
    if (sticks == catalogue_.end()) return;
    std::vector<Task> tasks;
    for (const Fit& fit : out_.fits) {
      const std::string name = fit.hypothesis.named() ? fit.hypothesis.title() : "";
      if (fit.hypothesis.terms().size() == 1 && fit.hypothesis.terms()[0] == &*sticks) break;
      const bool part = name == "intermittent_stiction";
      if ((!part && name != "backlash") || fit.score < out_.none().score + kParentLead) continue;
      const std::vector<double> own = fit.hypothesis.at(fit.population.top().z).searched[0];
      Hypothesis stiction(likelihood_.loop(), {&*sticks});
      Start start = from_parent(fit, stiction, 1.0);
      start.mean[0] = sticks->search[0].position(part ? own[0] : 1.1 * own[0]);
      start.deviation[0] = 0.03;
      start.mean[1] = part ? sticks->search[1].position(own[1]) : 0.1;
      start.deviation[1] = part ? 0.05 : 0.15;
      tasks.push_back({std::move(stiction), std::move(start), {160, 2, 6, 150}, 5, true});
    }
    search_all(tasks);
  }

  // Sticking hypotheses, with every slip by the law, from where slips by PV led. A friction that
  // hardly varies is a needle in the likelihood, which is found from there only.
  void stick_by_law(std::size_t effects) {
    std::vector<Task> tasks;
    for (const Fit& fit : out_.fits) {
      if (tasks.size() >= kByLaw) break;
      if (fit.hypothesis.terms().size() != effects) continue;
      if (fit.hypothesis.sticking() == Hypothesis::npos) continue;
      if (fit.score < out_.none().score + kParentLead) break;
      Start start = Start::around(fit.population.members, fit.population.best, 1.5, 0.02, 1.0);
      tasks.push_back({fit.hypothesis, std::move(start), {160, 2, 6, 150}, 6, true});
    }
    search_all(tasks);
  }

  // Adds hypotheses with one effect more than the best of `effects` - 1. Returns whether any is
  // worth a search.
  bool grow(std::size_t effects) {
    std::vector<Task> tasks;
    std::vector<std::string> seen;
    std::size_t parents = 0;
    const double none = out_.none().score;
    const std::vector<Fit> fits = out_.fits;
    for (const Fit& parent : fits) {
      if (parents >= (effects == 2 ? kParents : 1)) break;
      if (parent.hypothesis.terms().size() + 1 != effects) continue;
      if (parent.score < none + kParentLead) break;
      // A triple grows only from a pair that leads.
      if (effects > 2 && &parent != &fits.front()) break;
      const std::string title = parent.hypothesis.title();
      if (std::find(seen.begin(), seen.end(), title) != seen.end()) continue;
      seen.push_back(title);
      ++parents;
      add_children(parent, tasks);
    }
    if (tasks.empty()) return false;
    search_all(tasks);
    return out_.fits.front().hypothesis.terms().size() == effects;
  }

  struct Try {
    std::optional<Task> task;
    double log_likelihood = -1e300;
    std::size_t evaluations = 0;
  };

  void add_children(const Fit& parent, std::vector<Task>& tasks) {
    const std::vector<double> error = error_of(parent);
    std::vector<Try> tries(catalogue_.size());
    parallel_(catalogue_.size(), [&](std::size_t i) {
      const Law& other = catalogue_[i];
      for (const Law* term : parent.hypothesis.terms()) {
        if (!compatible(*term, other)) return;
      }
      tries[i] = try_child(parent, other, error);
    });
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < tries.size(); ++i) {
      out_.evaluations += tries[i].evaluations;
      if (tries[i].task && tries[i].log_likelihood > parent.log_likelihood() + kChildLead) {
        order.push_back(i);
      }
    }
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return tries[a].log_likelihood > tries[b].log_likelihood;
    });
    for (std::size_t i = 0; i < std::min(order.size(), kChildren); ++i) {
      tasks.push_back(std::move(*tries[order[i]].task));
    }
  }

  // The best of a few values of `other` next to the best member of `parent`.
  Try try_child(const Fit& parent, const Law& other, std::span<const double> error) const {
    Terms terms = parent.hypothesis.terms();
    terms.push_back(&other);
    std::stable_sort(terms.begin(), terms.end(), [&](const Law* a, const Law* b) {
      return a - catalogue_.data() < b - catalogue_.data();
    });
    Hypothesis child(likelihood_.loop(), terms);
    const std::size_t place =
        static_cast<std::size_t>(std::find(terms.begin(), terms.end(), &other) - terms.begin());
    const std::size_t first = child.first_of(place);
    const std::size_t own = other.coordinates();
    Start start = from_parent(parent, child, 0.8);
    use_statistics(child, place, error, start);
    const bool known = own > 0 && start.deviation[first] < 1.0;

    numeric::Random random(seed_of(child, 3));
    Try out;
    Likelihood::Work work;
    std::vector<double> z = start.mean;
    std::vector<double> best = z;
    const std::size_t count = own == 0 ? 16 : known ? 16 : own == 1 ? 28 : 40;
    const Layout& layout = child.layout();
    for (std::size_t t = 0; t < count; ++t) {
      // Without a parameter to search, the parent's own may move.
      const double wander = own == 0 && t >= 4 ? 1.0 : 0.0;
      for (std::size_t i = 0; i < layout.size; ++i) {
        const double deviation = wander * std::min(start.deviation[i], 0.15);
        z[i] = std::clamp(start.mean[i] + deviation * random.normal(), 0.0, 1.0);
      }
      for (std::size_t i = 0; i < own; ++i) {
        const bool sure = start.deviation[first + i] < 1.0;
        z[first + i] =
            sure ? std::clamp(start.mean[first + i] + start.deviation[first + i] * random.normal(),
                              0.0, 1.0)
            : own == 1 ? (std::floor(0.5 * static_cast<double>(t)) + 0.5) /
                             std::floor(0.5 * static_cast<double>(count))
                       : random.uniform();
      }
      // With less left, the error is smaller.
      if (t % 2 == 1) {
        z[layout.error] = std::max(0.01, z[layout.error] - 0.3);
        z[layout.error + 1] = std::max(0.01, z[layout.error + 1] - 0.22);
      }
      const double l = likelihood_.of(child, z, work);
      if (l > out.log_likelihood) {
        out.log_likelihood = l;
        best = z;
      }
    }
    start.mean = best;
    for (double& deviation : start.deviation) deviation = std::min(deviation, 0.15);
    start.deviation[layout.error] = start.deviation[layout.error + 1] = 0.3;
    out.task = Task{std::move(child), std::move(start), {48, 1, 3, 50}, 4};
    out.evaluations = work.evaluations;
    return out;
  }

  // Searches the parts of the best hypothesis again, from its posterior.
  void step_back() {
    for (int round = 0; round < 2; ++round) {
      const Fit whole = out_.fits.front();
      const Terms& terms = whole.hypothesis.terms();
      if (terms.size() < 2) return;
      std::vector<Task> tasks;
      for (std::size_t i = 0; i < terms.size(); ++i) {
        Terms part = terms;
        part.erase(part.begin() + static_cast<std::ptrdiff_t>(i));
        Hypothesis without(likelihood_.loop(), part);
        Start start = from_parent(whole, without, 0.85);
        tasks.push_back({std::move(without),
                         std::move(start),
                         {64, 2, 2, 100},
                         static_cast<std::uint64_t>(20 + round)});
      }
      search_all(tasks);
      if (out_.fits.front().hypothesis.terms() == terms) return;
    }
  }

  const Likelihood& likelihood_;
  const std::vector<Law>& catalogue_;
  const Slips& slips_;
  const numeric::ParallelFor& parallel_;
  const std::function<void(double)>& progress_;
  Competition out_;
};

}  // namespace

double score_of(const Fit& fit, const Likelihood& likelihood) {
  const auto n = static_cast<double>(likelihood.blocks().count());
  return fit.log_likelihood() - 0.5 * fit.hypothesis.parameters() * std::log(n) -
         fit.hypothesis.handicap();
}

const Fit& Competition::none() const {
  return *std::find_if(fits.begin(), fits.end(),
                       [](const Fit& f) { return f.hypothesis.terms().empty(); });
}

Competition compete(const Likelihood& likelihood, const std::vector<Law>& laws, const Slips& slips,
                    std::size_t most_effects, const numeric::ParallelFor& parallel,
                    const std::function<void(double)>& progress) {
  return Competitors(likelihood, laws, slips, parallel, {}, progress).run(most_effects);
}

void add_laws(Competition& competition, const Likelihood& likelihood, const std::vector<Law>& laws,
              const Slips& slips, const numeric::ParallelFor& parallel) {
  const std::function<void(double)> silent;
  competition =
      Competitors(likelihood, laws, slips, parallel, std::move(competition), silent).add();
}

}  // namespace loopwarden::estimator
