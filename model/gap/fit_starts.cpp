// SPDX-License-Identifier: Apache-2.0
// Where the search for one more effect starts from.
#include <algorithm>
#include <cmath>
#include <utility>

#include "model/gap/fit_work.hpp"

namespace loopwarden::gap {
namespace {

constexpr double kBentGain = 0.25;  // of itself, by which a gain found beside a cycle may be off
constexpr std::size_t kTaken = 2;   // of the places that were tried

bool less_deviance(const Fit& x, const Fit& y) { return x.deviance < y.deviance; }

double in_grid(const effects::SearchRange& range, int place) {
  return range.value((place + 0.5) / range.grid);
}

// The next place of the grid over all of `search`; false after the last.
bool advance(std::vector<int>& index, const std::vector<effects::SearchRange>& search) {
  for (std::size_t j = 0; j < index.size(); ++j) {
    if (++index[j] < search[j].grid) return true;
    index[j] = 0;
  }
  return false;
}

}  // namespace

// Of a gain that is not known beside a cycle, and the samples that runs are cut into.
struct Fitter::Sticking {
  double middle;
  double width;
  std::size_t short_run;
  std::vector<double> pv;  // PV units, without the fitted level

  double gain_at(double position) const { return middle + width * (2.0 * position - 1.0); }
};

struct Fitter::StickingStart {
  Fit fit;
  double gain_position;
};

struct Fitter::GridPlace {
  std::vector<double> values;
  std::size_t load;
  double deviance;
};

std::vector<Fit> Fitter::approach(const Fit& base, const Candidate& candidate,
                                  const std::vector<double>* hint) const {
  Work work;
  Fit fit = base;
  fit.terms.push_back(&candidate);
  // What the base had to bend to fit without the effect is no place to start from.
  fit.point.time_constant_s = free_run_.model().process.time_constant_s;
  fit.point.dead_time_s = free_run_.model().process.dead_time_s;
  if (candidate.slips) fit.point.actuator_damping = 0.3;
  fit.point.searched.emplace_back(candidate.search.size(), 0.0);
  std::vector<Fit> tries =
      candidate.slips ? sticking_tries(work, fit, hint) : grid_tries(work, fit, base.load);
  std::sort(tries.begin(), tries.end(), less_deviance);
  if (tries.size() > kTaken) tries.resize(kTaken);
  return tries;
}

std::vector<Fit> Fitter::sticking_tries(Work& work, const Fit& fit,
                                        const std::vector<double>* hint) const {
  std::vector<Fit> tries;
  for (const Fit& start : sticking_starts(fit, hint)) tries.push_back(search(work, start, 80));
  // A small stickband beside a large deadband shows best in one long run.
  const effects::SearchRange& range = fit.terms.back()->search[0];
  Fit at = fit;
  Fit start = fit;
  at.load = kLittleLoad;
  start.deviance = kInfinity;
  for (int i = 0; i < range.grid; ++i) {
    for (const double ratio : {0.05, 0.3}) {
      at.point.searched.back() = {in_grid(range, i), ratio, 0.0};
      evaluate(work, at.terms, at.point, kLittleLoad, &at);
      if (at.deviance < start.deviance) start = at;
    }
  }
  tries.push_back(search(work, start, 80));
  return tries;
}

std::vector<Fit> Fitter::grid_tries(Work& work, Fit fit, std::size_t base_load) const {
  const Candidate& candidate = *fit.terms.back();
  std::vector<double>& own = fit.point.searched.back();
  const std::vector<std::size_t> loads = base_load <= kLittleLoad
                                             ? std::vector<std::size_t>{kLittleLoad}
                                             : std::vector<std::size_t>{kLittleLoad, base_load};
  std::vector<GridPlace> places;
  const auto consider = [&] {
    for (const std::size_t load : loads) {
      places.push_back({own, load, solve(work, fit.terms, fit.point, load, nullptr)});
    }
  };
  if (candidate.linear_columns() > 0 && !candidate.search.empty()) {
    // Only the last columns change from place to place.
    for (std::size_t j = 0; j < own.size(); ++j) own[j] = candidate.search[j].value(0.5);
    columns(work, fit.terms, fit.point);
    const effects::SearchRange& range = candidate.search[0];
    std::vector<std::vector<double>> last;
    for (int i = 0; i < range.grid; ++i) {
      const double p = (i + 0.5) / range.grid;
      own[0] = range.is_period
                   ? 1.0 / (1.0 / range.high +
                            p * std::min(1.0 / range.low - 1.0 / range.high, 100.0 / range.high))
                   : range.value(p);
      free_run_.linear_columns(candidate, own, last);
      std::move(last.begin(), last.end(),
                work.columns.end() - static_cast<std::ptrdiff_t>(last.size()));
      consider();
    }
  } else {
    std::vector<int> index(candidate.search.size(), 0);
    do {
      for (std::size_t j = 0; j < index.size(); ++j) {
        own[j] = in_grid(candidate.search[j], index[j]);
      }
      columns(work, fit.terms, fit.point);
      consider();
    } while (advance(index, candidate.search));
  }
  // The best places under each load are all taken further with little load: a model that is allowed
  // much load explains everything a little, and has no slope to follow.
  std::vector<Fit> tries;
  fit.load = kLittleLoad;
  for (const std::size_t load : loads) {
    std::sort(places.begin(), places.end(), [&](const GridPlace& x, const GridPlace& y) {
      return std::make_pair(x.load != load, x.deviance) <
             std::make_pair(y.load != load, y.deviance);
    });
    for (std::size_t i = 0; i < std::min(candidate.starts, places.size()); ++i) {
      if (places[i].load != load) break;
      own = places[i].values;
      const bool bent = !candidate.smooth && candidate.starts > 1;
      tries.push_back(bent ? search(work, fit, 60) : descend(work, fit, 2));
    }
  }
  return tries;
}

// A free run of a sticking valve is a poor guide to its own parameters: one slip that is missed
// spoils what follows. Short runs that each start where the record stands lead near, runs ever
// longer lead on.
std::vector<Fit> Fitter::sticking_starts(const Fit& with, const std::vector<double>* hint) const {
  const plant::LoopModel& model = free_run_.model();
  const double slow_s =
      plant::answer_s(model) - model.process.dead_time_s + with.point.dead_time_s +
      (model.process.integrating() ? 0.0
                                   : with.point.time_constant_s - model.process.time_constant_s);
  const bool gain_changed = solves_gain(with.terms);
  // A gain that was found without the cycle is bent by it: as wide as it may be off, and from three
  // places.
  const double middle = gain_changed ? with.solved[0] : 1.0;
  Sticking sticking{middle, gain_changed ? kBentGain * middle : model.uncertainty.gain,
                    static_cast<std::size_t>(std::max(8.0 * slow_s / model.sample_time_s, 60.0)),
                    pv_};
  const std::vector<double> gain_positions =
      gain_changed ? std::vector<double>{0.2, 0.5, 0.86} : std::vector<double>{0.5};
  const double level = free_run_.fitted_level(with.solved);
  for (double& v : sticking.pv) v -= level;
  const Candidate& candidate = *with.terms.back();
  const auto better = [](const StickingStart& x, const StickingStart& y) {
    return less_deviance(x.fit, y.fit);
  };
  const std::size_t kept = hint != nullptr ? candidate.starts - 1 : candidate.starts;
  std::vector<StickingStart> found;  // best first
  Fit fit = with;
  for (const double gain_position : gain_positions) {
    for (const double damping : {0.3, 1.2}) {
      fit.point.actuator_damping = damping;
      for (int i = 0; i < candidate.search[0].grid; ++i) {
        for (int j = 0; j < candidate.search[1].grid; ++j) {
          fit.point.searched.back() = {in_grid(candidate.search[0], i),
                                       in_grid(candidate.search[1], j), 0.0};
          const double most = found.size() < kept ? kInfinity : found.back().fit.deviance;
          fit.deviance =
              free_run_.short_runs(with.terms, fit.point, sticking.pv, used_,
                                   sticking.gain_at(gain_position), sticking.short_run, most);
          if (!(fit.deviance < most)) continue;
          if (found.size() == kept) found.pop_back();
          StickingStart start{fit, gain_position};
          const auto place = std::upper_bound(found.begin(), found.end(), start, better);
          found.insert(place, std::move(start));
        }
      }
    }
  }
  if (hint != nullptr) {
    fit.point.searched.back() = *hint;
    found.push_back({fit, 0.5});
  }
  for (StickingStart& start : found) lead_on(start, sticking, hint != nullptr ? 4 : 2);
  std::sort(found.begin(), found.end(), better);
  std::vector<Fit> best;
  for (std::size_t i = 0; i < std::min(found.size(), kTaken); ++i) {
    best.push_back(std::move(found[i].fit));
  }
  return best;
}

void Fitter::lead_on(StickingStart& from, const Sticking& sticking, std::size_t longer) const {
  Fit& start = from.fit;
  const auto count = static_cast<double>(filters_.front().count());
  // Process, actuator, s, j/s, and the gain.
  std::vector<double> x = positions(start);
  const std::size_t own_at = x.size() - 3;
  std::vector<double> own{x[0], x[1], x[2], x[3], x[own_at], x[own_at + 1], from.gain_position};
  const auto at_point = [&](const std::vector<double>& at) {
    std::copy(at.begin(), at.begin() + 4, x.begin());
    std::copy(at.begin() + 4, at.begin() + 6, x.begin() + static_cast<std::ptrdiff_t>(own_at));
    return with_positions(start.terms, x);
  };
  for (std::size_t run = sticking.short_run; run < 16 * sticking.short_run; run *= longer) {
    const std::size_t samples = run < 8 * sticking.short_run ? run : used_.size();
    minimise(own, {0.2, 0.2, 0.15, 0.15, 0.02, 0.08, 0.2}, run == sticking.short_run ? 200 : 120,
             0.5, [&](const std::vector<double>& at) {
               const double left = free_run_.short_runs(start.terms, at_point(at), sticking.pv,
                                                        used_, sticking.gain_at(at[6]), samples);
               return count * std::log(left / pv_square_);
             });
  }
  // Where the stem stood at the start of the one long run.
  Work work;
  Fit at = start;
  at.point = at_point(own);
  start.load = kLittleLoad;
  start.deviance = kInfinity;
  for (int place = -9; place <= 9; ++place) {
    at.point.searched.back().back() = 0.1 * place;
    evaluate(work, at.terms, at.point, kLittleLoad, &at);
    if (at.deviance < start.deviance) start = at;
  }
}

}  // namespace loopwarden::gap
