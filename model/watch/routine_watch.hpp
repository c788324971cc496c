// SPDX-License-Identifier: Apache-2.0
// Routine evidence on a running loop: diagnose() judges the last minutes and hours. It needs no
// model and no specialists, and detects a slow and wide dead band that no window of 96 s shows.
// Equations: docs/math/routine-evidence.md. tests/model/watch/routine_evidence_test.cpp measures
// this rule on simulated loops.
//
// Memory: 48 kB per loop for PV and CO, held from the start, and 8 bytes per change of SP in two
// windows of each level. add() allocates for a full window and for a changed SP. Routine evidence
// doesn't survive the program: after a restart the first window of each level must fill again.
// Errors: std::bad_alloc.
// Limits: it can't see a dead band in less than one full window, or in a loop without movement. It
// distinguishes valve effects no better than diagnose().
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "model/diagnosis/archive_rule.hpp"
#include "model/diagnosis/diagnosis.hpp"
#include "model/alarm/loop_alarms.hpp"
#include "model/diagnosis/limits.hpp"
#include "model/watch/limits.hpp"
#include "model/watch/run_column.hpp"
#include "model/watch/window_builder.hpp"
#include "model/alarm/window_judge.hpp"

namespace loopwarden::watch {

class RoutineWatch {
 public:
  // The result of a window, or of two windows as one record.
  struct Judgement {
    double window_s = 0.0;  // the length of the judged samples
    bool whole = true;      // all samples were judged; false: a part, away from CO's limits
    diagnosis::DiagnosisVerdict verdict = diagnosis::DiagnosisVerdict::not_enough_data;
    diagnosis::Grade grade = diagnosis::Grade::none;
    double probability = 0.5;  // of a valve effect
    diagnosis::ValveEvidence evidence;
    double sum_before = 0.0;        // nats, S before this judgement
    double from_specialists = 0.0;  // nats, w
    double sum = 0.0;               // nats, S after this judgement
    alarm::AlarmKind fault = alarm::AlarmKind::stiction;
    double severity_percent = 0.0;  // % of the CO span
    diagnosis::Archived source{};   // the source's rule for PV and CO
    double sees_from_percent =
        0.0;  // detection limit, % of the CO span; 0: no limit, infinite: unknown
  };

  // The present state of one level.
  struct Progress {
    double window_s = 0.0;     // the length of one window
    double filled_s = 0.0;     // part of the next one
    std::size_t windows = 0;   // judged since the start
    double sum = 0.0;          // nats, S
    double probability = 0.5;  // of a valve effect, by the newest judgement
    diagnosis::DiagnosisVerdict verdict = diagnosis::DiagnosisVerdict::not_enough_data;
    alarm::AlarmKind fault = alarm::AlarmKind::stiction;  // if the verdict is a valve effect
    double severity_percent = 0.0;                        // % of the CO span, the same
  };
  using Levels = std::array<Progress, Limits::kRoutineSampleTimes_s.size()>;

  // The samples of a judgement.
  struct Samples {
    double period_s = 1.0;
    std::span<const float> pv, co;
    std::vector<float> sp;  // all NaN if unknown
  };

  explicit RoutineWatch(const WindowSettings& settings);

  // Adds a cycle. Returns true if a window was judged; judgement() and conditions() are then of
  // that window.
  bool add(const Cycle& cycle);
  // Restores a condition from before a restart. It stays until a window contradicts it.
  void restore(alarm::AlarmKind kind, bool on, double severity_percent) noexcept;
  // Adds a judged window of the specialists, for w.
  void specialists(const alarm::WindowJudgement& judgement) noexcept;

  const Judgement& judgement() const noexcept { return judgement_; }
  // Returns the samples of judgement(), if the last add() judged; valid until the next add().
  Samples samples() const;
  const alarm::AlarmConditions& conditions() const noexcept { return conditions_; }
  // Returns the levels, the finest first. A level that a slow loop lacks has a window of 0 s.
  Levels levels() const noexcept;

 private:
  struct Level {
    std::size_t decimation = 1;  // cycles per sample
    double sample_time_s = 1.0;
    // 2 kRoutineSamples places: the window before, then the window in progress.
    std::vector<float> pv, co;
    RunColumn sp;             // the same samples
    bool has_before = false;  // the window before is valid, without a break in between
    bool full =
        false;  // the second window was judged, and becomes the one before with the next sample
    std::size_t count = 0;      // samples of the window in progress
    std::size_t in_sample = 0;  // cycles in the sums
    std::size_t left_out = 0;   // cycles since the last usable one
    double sum_sp = 0.0;
    double sum_pv = 0.0;
    double sum_co = 0.0;
    double from_specialists = 0.0;  // sum of probabilities since the level's last window
    std::size_t specialist_windows = 0;
    std::size_t windows = 0;   // judged
    double probability = 0.5;  // of the newest window only
    Judgement newest;
    double sum = 0.0;  // nats, S
    bool on = false;
    alarm::AlarmKind fault = alarm::AlarmKind::stiction;
    double severity_percent = 0.0;
  };
  void leave_out(Level& level, std::uint64_t cycles, bool manual) noexcept;
  bool take(Level& level, const Cycle& cycle);  // true if it is full
  static Samples samples_of(const Level& level, std::size_t count);
  Judgement judge_newest(const Level& level, std::size_t count) const;
  Judgement judge(Level& level);
  void learn(const Level& level);
  void settle_conditions() noexcept;

  std::vector<Level> levels_;
  bool has_set_point_;
  bool on_change_;
  diagnosis::Archived source_;
  double co_low_;
  double co_high_;
  std::uint64_t last_period_ = 0;
  bool any_ = false;
  Judgement judgement_;
  std::size_t judged_ = 0;          // its level
  std::size_t judged_samples_ = 0;  // its newest samples
  alarm::AlarmConditions restored_{};
  alarm::AlarmConditions conditions_{};
};

// Returns the judgement of diagnose() for these samples, without earlier evidence and without
// specialists.
RoutineWatch::Judgement judge_routine(const numeric::LoopView& record,
                                      const diagnosis::Archived& source = {});

}  // namespace loopwarden::watch
