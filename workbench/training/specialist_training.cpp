// SPDX-License-Identifier: Apache-2.0
#include "workbench/training/specialist_training.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "base/digest/digest.hpp"
#include "config/loop_model_writer.hpp"
#include "base/parallel.hpp"
#include "model/specialist/train/limits.hpp"
#include "workbench/training/training_checkpoint.hpp"

namespace loopwarden::workbench {
namespace {

using specialist::Condition;

// Streams of the seed, separate from those of the networks' starts.
constexpr std::uint64_t kSignatureStream = 1000003;
constexpr std::uint64_t kHeldOutStream = 2000003;

// Returns a key of all settings that decide the result. The number of threads does not.
std::string key_of(const TrainingJob& job) {
  std::string text = job.model ? config::write_model(*job.model) : std::string();
  for (const specialist::Signature& s : job.signatures) {
    text += fmt::format("{} {} ", to_text(s.condition), to_text(s.role));
    for (const double value : s.pv) text += fmt::format("{} ", value);
  }
  const specialist::TeamTrainingSettings& t = job.team;
  const specialist::GrowingSettings& g = job.growing;
  text += fmt::format("{} {} {} {} {} {} {} {} {}", t.seed, t.windows, t.hidden, t.restarts,
                      t.most_epochs, t.patience, g.seed, g.components, g.learning.most_epochs);
  for (const std::size_t size : g.sizes) text += fmt::format(" {}", size);
  for (std::size_t i = 0; i < specialist::kNetworkInputs; ++i) {
    text += fmt::format(" {}", specialist::input_name(i));
  }
  return base::sha256_hex(text);
}

std::vector<specialist::Signature> simulated_signatures(const TrainingJob& job) {
  std::vector<specialist::Signature> signatures;
  const std::uint64_t seed = specialist::stream_seed(job.growing.seed, kSignatureStream);
  for (const Condition condition : job.conditions) {
    for (std::size_t i = 0; i < specialist::TrainLimits::kSignaturesOfCondition; ++i) {
      const std::uint64_t place =
          static_cast<std::uint64_t>(condition) * specialist::TrainLimits::kSignaturesOfCondition +
          i;
      signatures.push_back(specialist::simulate_signature(*job.model, condition,
                                                          specialist::stream_seed(seed, place)));
      signatures.back().role = specialist::role_of(i);
    }
  }
  return signatures;
}

std::vector<Condition> conditions_of(const std::vector<specialist::Signature>& signatures) {
  std::vector<Condition> found;
  for (const specialist::Signature& s : signatures) {
    if (std::find(found.begin(), found.end(), s.condition) == found.end()) {
      found.push_back(s.condition);
    }
  }
  return found;
}

class Trainer {
 public:
  Trainer(const TrainingJob& job, const TrainingListener& listener)
      : job_(job), listener_(listener) {
    if (job.checkpoint) checkpoint_.emplace(*job.checkpoint, key_of(job));
  }

  TrainingResult train() {
    result_.folder.plant = job_.plant;
    result_.folder.training = {job_.source, job_.team.seed, 0, 0};
    if (job_.explaining && job_.model) train_team();
    if (job_.signature) train_signatures();
    return std::move(result_);
  }

 private:
  void say(const std::string& text) {
    const std::lock_guard lock(mutex_);
    if (listener_.say) listener_.say(text);
  }
  void live(const std::string& text) {
    const std::lock_guard lock(mutex_);
    if (listener_.live) listener_.live(text);
  }

  specialist::ParallelFor parallel() const {
    return [threads = job_.threads](std::size_t count, const auto& body) {
      base::parallel_for(count, threads, body);
    };
  }

  // Simulates block by block, so that an interrupted run keeps the finished blocks.
  std::vector<specialist::Example> simulated_examples() {
    constexpr std::size_t kBlock = 512;
    std::vector<specialist::Example> examples;
    examples.reserve(job_.team.windows);
    std::size_t kept = 0;
    while (examples.size() < job_.team.windows) {
      const std::size_t first = examples.size();
      const std::size_t count = std::min(kBlock, job_.team.windows - first);
      const std::string name = fmt::format("windows-{}", first);
      std::optional<std::vector<specialist::Example>> block;
      if (checkpoint_) block = checkpoint_->find_examples(name, count);
      if (block) {
        kept += count;
      } else {
        block =
            specialist::simulate_examples(*job_.model, count, job_.team.seed, parallel(), first);
        if (checkpoint_) checkpoint_->keep_examples(name, *block);
      }
      examples.insert(examples.end(), block->begin(), block->end());
      live(fmt::format("{} of {} windows simulated", examples.size(), job_.team.windows));
    }
    if (kept > 0) say(fmt::format("{} windows were there from an interrupted run", kept));
    return examples;
  }

  void train_team() {
    say(fmt::format("explaining form: {} simulated windows, networks {}-{}-{}-1", job_.team.windows,
                    specialist::kNetworkInputs, job_.team.hidden, job_.team.hidden));
    const std::vector<specialist::Example> examples = simulated_examples();
    specialist::TeamHooks hooks;
    hooks.epoch = [&](const specialist::TeamEpoch& e) {
      live(fmt::format("team, start {}: epoch {}, training {:.4f}, validation {:.4f} nats",
                       e.restart + 1, e.epoch + 1, e.training, e.validation));
    };
    const auto name = [](std::size_t restart) { return fmt::format("team-{}", restart); };
    if (checkpoint_) {
      hooks.find = [&](std::size_t r) { return checkpoint_->find_team(name(r)); };
    }
    hooks.finished = [&](std::size_t r, const specialist::TeamRestart& restart) {
      if (checkpoint_) checkpoint_->keep_team(name(r), restart);
      say(fmt::format("team, start {}: {} epochs, validation {:.4f} nats", r + 1,
                      restart.epochs.size(), restart.validation));
    };
    specialist::TeamTraining trained = specialist::train_team(
        specialist::facts_of(*job_.model), examples, job_.team, parallel(), hooks);
    for (specialist::TeamMember& member : trained.team.members) {
      member.name = specialist_name(job_.plant, member.condition, job_.team.hidden, true);
    }
    result_.team_epochs = std::move(trained.epochs);
    result_.folder.training.windows = examples.size();
    if (job_.held_out > 0) {
      result_.folder.figures =
          measure_team(trained.team, *job_.model, job_.held_out,
                       specialist::stream_seed(job_.team.seed, kHeldOutStream), job_.threads);
    }
    result_.folder.team = std::move(trained.team);
  }

  void train_signatures() {
    const std::vector<specialist::Signature> signatures =
        job_.signatures.empty() ? simulated_signatures(job_) : job_.signatures;
    const std::vector<Condition> conditions = conditions_of(signatures);
    std::vector<std::vector<double>> all;
    for (const specialist::Signature& s : signatures) all.push_back(s.pv);
    const specialist::Scaling scaling = specialist::scaling_of(all);
    say(fmt::format("signature form: {} signatures of {} conditions", signatures.size(),
                    conditions.size()));
    std::vector<specialist::Grown> grown(conditions.size());
    base::parallel_for(conditions.size(), job_.threads, [&](std::size_t i) {
      grown[i] = specialist::grow(signatures, conditions[i], scaling, job_.growing,
                                  hooks_for(conditions[i]));
    });
    for (std::size_t i = 0; i < conditions.size(); ++i) {
      const specialist::Grown& g = grown[i];
      for (std::size_t k = 0; k < g.sizes.size(); ++k) {
        const specialist::GrownSize& s = g.sizes[k];
        result_.sizes.push_back({specialist_name(job_.plant, conditions[i], s.size, false), s.size,
                                 k == g.chosen, s.learned.epochs, s.learned.best, s.learned.stop,
                                 scaling.half_span});
      }
      specialist::SignatureSpecialist member = g.specialist;
      member.name = specialist_name(job_.plant, conditions[i], g.sizes[g.chosen].size, false);
      result_.folder.signatures.push_back(std::move(member));
    }
    result_.folder.training.signatures = signatures.size();
  }

  specialist::GrowingHooks hooks_for(Condition condition) {
    specialist::GrowingHooks hooks;
    const auto name = [this, condition](std::size_t size, std::size_t restart) {
      return fmt::format("{}-{}", specialist_name(job_.plant, condition, size, false), restart);
    };
    if (checkpoint_) {
      hooks.find = [this, name](std::size_t size, std::size_t restart) {
        return checkpoint_->find_network(name(size, restart));
      };
    }
    hooks.epoch = [this, name](std::size_t size, std::size_t restart, std::size_t epoch,
                               const specialist::Epoch& e) {
      live(fmt::format(
          "{}: epoch {}, training {:.3g}, validation {:.3g}, test {:.3g}, "
          "gradient {:.2g}, mu {:.0g}",
          name(size, restart), epoch, e.training, e.validation, e.test, e.gradient, e.mu));
    };
    hooks.finished = [this, name](std::size_t size, std::size_t restart,
                                  const specialist::Learned& learned) {
      if (checkpoint_) checkpoint_->keep_network(name(size, restart), learned);
      const specialist::Epoch& best = learned.epochs[learned.best];
      say(
          fmt::format("{}: {} epochs, stopped by {}; best at {}: training {:.3g}, validation "
                      "{:.3g}, test {:.3g}",
                      name(size, restart), learned.epochs.size() - 1, to_text(learned.stop),
                      learned.best, best.training, best.validation, best.test));
    };
    return hooks;
  }

  const TrainingJob& job_;
  const TrainingListener& listener_;
  std::optional<TrainingCheckpoint> checkpoint_;
  std::mutex mutex_;  // guards the listener
  TrainingResult result_;
};

}  // namespace

std::string specialist_name(const std::string& plant, Condition condition, std::size_t hidden,
                            bool explaining) {
  constexpr std::array kLetters{"N", "S", "B", "H", "L", "O"};
  return fmt::format("{}{}{}{}", plant, kLetters[static_cast<std::size_t>(condition)], hidden,
                     explaining ? "x" : "");
}

TrainingResult train_specialists(const TrainingJob& job, const TrainingListener& listener) {
  return Trainer(job, listener).train();
}

config::SpecialistFigures measure_team(const specialist::Team& team, const plant::LoopModel& model,
                                       std::size_t count, std::uint64_t seed, unsigned threads) {
  using specialist::VerdictName;
  struct Seen {
    Condition truth = Condition::no_fault;
    specialist::WindowVerdict verdict;
  };
  constexpr std::size_t kBins = 10;
  const std::size_t all = specialist::kConditions * count;
  std::vector<Seen> seen(all);
  base::parallel_for(specialist::kConditions, threads, [&](std::size_t c) {
    specialist::TeamJudge judge(team);
    for (std::size_t k = c * count; k < (c + 1) * count; ++k) {
      const specialist::SimulatedWindow window = specialist::simulate_window(
          model, {.condition = static_cast<Condition>(c)}, specialist::stream_seed(seed, k));
      seen[k] = {window.condition, judge.judge(window.view())};
    }
  });
  std::size_t faulty = 0;
  std::size_t named = 0;
  std::size_t alarms = 0;
  std::size_t undecided = 0;
  std::array<double, kBins> said{};
  std::array<double, kBins> right{};
  for (const Seen& s : seen) {
    const bool valve = s.truth != Condition::no_fault && s.truth != Condition::other;
    const bool fault = specialist::names_fault(s.verdict.verdict);
    faulty += valve ? 1U : 0U;
    named +=
        valve && static_cast<std::size_t>(s.verdict.verdict) == static_cast<std::size_t>(s.truth)
            ? 1U
            : 0U;
    alarms += !valve && fault ? 1U : 0U;
    undecided += s.verdict.verdict == VerdictName::not_enough_movement ? 1U : 0U;
    for (std::size_t c = 0; c < specialist::kConditions; ++c) {
      const double p = s.verdict.probabilities[c];
      const auto bin = std::min(kBins - 1, static_cast<std::size_t>(p * kBins));
      said[bin] += p;
      right[bin] += static_cast<std::size_t>(s.truth) == c ? 1.0 : 0.0;
    }
  }
  config::SpecialistFigures f;
  f.windows = all;
  const auto percent = [](std::size_t part, std::size_t of) {
    return of > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(of) : 0.0;
  };
  f.named_percent = percent(named, faulty);
  f.false_alarm_percent = percent(alarms, all - faulty);
  f.undecided_percent = percent(undecided, all);
  for (std::size_t b = 0; b < kBins; ++b) f.calibration_error += std::abs(said[b] - right[b]);
  f.calibration_error /=
      static_cast<double>(std::max<std::size_t>(1, all * specialist::kConditions));
  return f;
}

}  // namespace loopwarden::workbench
