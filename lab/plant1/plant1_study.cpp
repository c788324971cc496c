// SPDX-License-Identifier: Apache-2.0
// This fit is separate from model/gap: it fits one corrected plant to five records of PV together,
// while gap fits one record.
#include "lab/plant1/plant1_study.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "base/parallel.hpp"
#include "lab/plant1/shared_fit.hpp"

namespace loopwarden::lab {
namespace {

// Effect of each condition in the joint fit, as it was made in the experiment.
constexpr std::pair<const char*, const char*> kMadeBy[] = {
    {"no_fault", "none"},
    {"backlash", "backlash"},
    {"low_air_supply", "low_air_supply (preload)"},
    {"stiction", "cam_obstruction"},
    {"hysteresis", "hysteresis (offset)"},
};
constexpr double kRecordLength = 96.0;  // s
constexpr double kResponseTime = 4.3;   // s, published dead time and time constant
constexpr std::size_t kJointPopulation = 80;
constexpr std::size_t kJointIslands = 2;
constexpr std::size_t kTrialPopulation = 24;
constexpr std::size_t kTrialGenerations = 60;
constexpr double kHopeless = 100.0;  // misfit of a run with NaN or infinity

std::vector<FitBound> own_bounds(const Plant1Candidate& candidate) {
  std::vector<FitBound> bounds = plant1_own_bounds();
  bounds.insert(bounds.end(), candidate.bounds.begin(), candidate.bounds.end());
  return bounds;
}

double misfit_of(const Plant1Record& record, const plant::LoopModel& model) {
  const double value = misfit(record, plant1_run(model, record.pv.size()));
  return std::isfinite(value) ? value : kHopeless;
}

void fit_published(Plant1Outcome& row, const Plant1Work& work) {
  const SharedFitProblem problem{
      .shared = {},
      .own = {plant1_own_bounds()},
      .cost = [&](std::size_t, std::span<const double>, std::span<const double> own) {
        return misfit_of(row.record, plant1_published(row.record, own[0], own[1]));
      }};
  const SharedFit fit = fit_shared(
      problem, {.population = 16, .generations = 30, .seed = work.seed, .threads = work.threads});
  row.published_divisor = fit.own[0][0];
  row.published_misfit = fit.total;
  row.published_pv =
      plant1_run(plant1_published(row.record, fit.own[0][0], fit.own[0][1]), row.record.pv.size());
}

SharedFit fit_joint(const std::vector<Plant1Outcome>& rows, const Plant1Work& work,
                    const std::function<void(std::size_t)>& progress) {
  SharedFitProblem problem;
  problem.shared = plant1_shared_bounds();
  for (const Plant1Outcome& row : rows) {
    problem.own.push_back(own_bounds(plant1_effect_of(row.record.condition)));
  }
  problem.cost = [&](std::size_t r, std::span<const double> shared, std::span<const double> own) {
    const Plant1Record& record = rows[r].record;
    return misfit_of(record,
                     plant1_corrected(record, shared, own, plant1_effect_of(record.condition)));
  };
  return fit_shared(problem, {.population = kJointPopulation,
                              .generations = work.generations,
                              .islands = kJointIslands,
                              .seed = work.seed,
                              .threads = work.threads,
                              .progress = progress});
}

// `held`: divisor and time of the step if another record determines them; otherwise empty.
Plant1Trial try_candidate(const Plant1Record& record, const std::vector<double>& plant_parameters,
                          const Plant1Candidate& candidate, const std::vector<double>& held,
                          std::uint64_t seed) {
  const auto all = [&](std::span<const double> own) {
    std::vector<double> values = held;
    values.insert(values.end(), own.begin(), own.end());
    return values;
  };
  const auto cost = [&](std::size_t, std::span<const double>, std::span<const double> own) {
    return misfit_of(record, plant1_corrected(record, plant_parameters, all(own), candidate));
  };
  Plant1Trial trial{.name = candidate.name, .label = candidate.label, .own = held};
  if (!held.empty() && candidate.bounds.empty()) {
    trial.misfit = cost(0, {}, {});
  } else {
    const SharedFitProblem problem{.shared = {},
                                   .own = {held.empty() ? own_bounds(candidate) : candidate.bounds},
                                   .cost = cost};
    const SharedFit fit = fit_shared(
        problem, {.population = kTrialPopulation, .generations = kTrialGenerations, .seed = seed});
    trial.own = all(fit.own[0]);
    trial.misfit = fit.total;
  }
  trial.score = plant1_score(trial.misfit, candidate.bounds.size());
  return trial;
}

const Plant1Trial& trial_as_made(const Plant1Outcome& row) {
  return *std::find_if(row.trials.begin(), row.trials.end(), [&](const Plant1Trial& trial) {
    return trial.label == plant1_effect_of(row.record.condition).label;
  });
}

}  // namespace

const Plant1Candidate& plant1_effect_of(const std::string& condition) {
  for (const auto& [made, label] : kMadeBy) {
    if (condition == made) return plant1_candidate(label);
  }
  throw std::logic_error("no condition " + condition);
}

double plant1_score(double misfit, std::size_t parameters) {
  constexpr double kIndependent = kRecordLength / kResponseTime;
  return kIndependent * std::log(misfit) + static_cast<double>(parameters) * std::log(kIndependent);
}

Plant1Study study_plant1_records(const std::vector<Plant1Record>& records, const Plant1Work& work) {
  const std::vector<Plant1Candidate>& candidates = plant1_candidates();
  const std::size_t trials = records.size() * candidates.size();
  const std::size_t joint_work = kJointIslands * work.generations;
  const std::size_t total = joint_work + trials;
  const auto report = [&](std::size_t done) {
    if (work.progress) work.progress(done, total);
  };

  Plant1Study study;
  for (const Plant1Record& record : records) {
    Plant1Outcome& row = study.rows.emplace_back();
    row.record = record;
    fit_published(row, work);
  }
  std::vector<Plant1Outcome> fitted = study.rows;
  if (work.from_healthy) {
    std::erase_if(fitted,
                  [](const Plant1Outcome& row) { return row.record.condition != "no_fault"; });
    if (fitted.empty()) throw std::invalid_argument("no record without a fault");
  }
  const SharedFit joint = fit_joint(fitted, work, report);
  study.shared = joint.shared;
  const std::vector<double> held = work.from_healthy ? joint.own[0] : std::vector<double>{};
  for (Plant1Outcome& row : study.rows) row.trials.resize(candidates.size());
  base::parallel_for(
      trials, work.threads,
      [&](std::size_t i) {
        Plant1Outcome& row = study.rows[i / candidates.size()];
        const std::size_t c = i % candidates.size();
        row.trials[c] = try_candidate(row.record, study.shared, candidates[c], held, work.seed);
      },
      [&](std::size_t done) { report(joint_work + done); });
  for (std::size_t r = 0; r < records.size(); ++r) {
    Plant1Outcome& row = study.rows[r];
    row.own = work.from_healthy ? trial_as_made(row).own : joint.own[r];
    row.corrected_misfit = work.from_healthy ? trial_as_made(row).misfit : joint.cost[r];
    row.corrected_pv = plant1_run(
        plant1_corrected(row.record, study.shared, row.own, plant1_effect_of(row.record.condition)),
        row.record.pv.size());
  }
  for (Plant1Outcome& row : study.rows) {
    std::stable_sort(row.trials.begin(), row.trials.end(),
                     [](const Plant1Trial& a, const Plant1Trial& b) { return a.score < b.score; });
  }
  return study;
}

}  // namespace loopwarden::lab
