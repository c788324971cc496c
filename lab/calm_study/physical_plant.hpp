// SPDX-License-Identifier: Apache-2.0
// A loop with a sticking valve whose air, stem and process are integrated at 1 ms. It uses the
// equations of the hidden cases (lab/hidden_cases/element.hpp) and no code of model/plant, whose
// laws the study's other loops use.
//
//   CO -> air (lag) -> stem (spring, static, moving and viscous friction) -> dead time -> lag, gain
//      -> + load -> PV
//
// From the model of a loop it uses process, transmitter and the intensity of `random_load`.
#pragma once

#include <cstdint>

#include "lab/hidden_cases/element.hpp"
#include "model/numeric/random.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::lab {

enum class PhysicalFriction : std::uint8_t { karnopp, stribeck, lugre };

struct PhysicalValve {
  PhysicalFriction friction = PhysicalFriction::karnopp;
  double s = 0.0;                   // CO units, static and moving friction together
  double j = 0.0;                   // CO units, their difference
  double air_lag_s = 0.2;           // s, > 0
  double frequency_rad_s = 30.0;    // of the stem on its spring
  double damping_s = 0.08;          // viscous friction divided by the spring's stiffness
  double stribeck_per_s = 0.02;     // CO units/s: stribeck, lugre
  double bristle_stiffness = 60.0;  // relative to the spring's: lugre
};
PhysicalValve random_physical_valve(numeric::Random& random, double s, double j);

// Same interface as plant::Plant, as far as a trial needs it.
class PhysicalPlant {
 public:
  PhysicalPlant(const plant::LoopModel& model, const PhysicalValve& valve);

  double output_for(double pv) const noexcept { return pv / gain_; }
  void reset(double co);
  void step(double co);
  double time_s() const noexcept { return static_cast<double>(samples_) * period_s_; }
  double stem() const noexcept { return stem_; }
  double true_process_variable() const noexcept { return true_pv_; }
  double process_variable() const noexcept { return pv_; }

 private:
  void read();

  double gain_;
  double period_s_;
  plant::TransmitterParameters transmitter_;
  double load_per_root_s_ = 0.0;
  numeric::Random random_;
  hidden_cases::Chain valve_;
  hidden_cases::Chain process_;
  std::uint64_t samples_ = 0;
  double stem_ = 0.0;
  double flow_ = 0.0;  // PV units, without load
  double load_ = 0.0;  // PV units
  double true_pv_ = 0.0;
  double pv_ = 0.0;
};

}  // namespace loopwarden::lab
