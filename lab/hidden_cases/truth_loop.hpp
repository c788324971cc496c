// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "lab/hidden_cases/element.hpp"
#include "lab/hidden_cases/random.hpp"

namespace loopwarden::hidden_cases {

inline constexpr double kPeriod_s = 0.1;
// 12 bits over 0 to 10, for PV and CO.
inline constexpr double kResolution = 10.0 / 4096.0;

struct Tuning {
  double kp;
  double ki_per_s;
};

// The controller of the loop, every 0.1 s: I += ki h e with the newest e, I held within +-10, then
// u = kp e + I held within 0 to 10 and rounded to 12 bits.
class SampledPi {
 public:
  SampledPi(Tuning tuning, double integral) : tuning_(tuning), integral_(integral) {}
  void retune(Tuning tuning) { tuning_ = tuning; }
  double step(double set_point, double pv);

 private:
  Tuning tuning_;
  double integral_;
};

// (start in s, set point), the first one at 0.
using SetPointProfile = std::vector<std::pair<double, double>>;
double set_point_at(const SetPointProfile& profile, double time_s);

// The true loop.
struct TruthLoop {
  // Controller output -> valve -> process.
  Chain path;
  // Signals added to PV, as functions of the record's time.
  std::vector<std::function<double(double)>> added;
  // Lag of the impulse line, s, as a function of the record's time, and the curve of the reading;
  // empty: not present.
  std::function<double(double)> line_lag_s;
  std::function<double(double)> meter;
  // Upper limit of the transmitter's reading.
  double transmitter_top = std::numeric_limits<double>::infinity();
  // Number of samples for which a reading is held; 1: each is new.
  std::size_t reading_stands = 1;
  Tuning tuning{};
  // Settings of the controller from a time on, s.
  std::optional<std::pair<double, Tuning>> retuned{};
  double noise_rms = 0.0;
  // Unmeasured load on PV: Ornstein-Uhlenbeck, PV units per root second, time constant 300 s.
  double load_per_root_s = 0.0;
  // Changed load: start in s, PV units per root second.
  std::optional<std::pair<double, double>> load_later{};
};

// One sample per row; rows before `first` precede the record.
struct LoopRecord {
  std::vector<double> time_s;
  std::vector<double> sp;
  std::vector<double> pv;
  std::vector<double> co;
  // True PV for the same CO, without noise and load.
  std::vector<double> truth_pv;
  std::size_t first = 0;
};

// What happens after a record, one value per sample: added to the last set point in automatic, or
// to the last output in manual.
struct Moves {
  bool manual = false;
  std::size_t from = 0;  // samples in automatic at the last set point
  std::vector<double> moved;
};

// Runs the loop from rest at the first set point. The record begins after `before` samples, and
// `moves` follow it.
LoopRecord run(TruthLoop& loop, const SetPointProfile& profile, std::size_t samples,
               std::size_t before, Random& random, const Moves& moves = {});

// Returns the true PV for a given CO, from rest at `rest_pv`; the row `first` is time 0.
std::vector<double> free_run(TruthLoop& loop, double rest_pv, const std::vector<double>& co,
                             std::size_t first);

// Returns the RMSE of measured PV against the true free run over the last third of the record.
double floor_rmse(const LoopRecord& record);

}  // namespace loopwarden::hidden_cases
