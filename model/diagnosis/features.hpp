// SPDX-License-Identifier: Apache-2.0
// All that is measured on a record to judge its valve, as one list of numbers without unit, each bounded
// and independent of sample time and span. docs/diagnose.md explains every kind.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "model/diagnosis/preparation.hpp"
#include "model/diagnosis/valve_fit.hpp"

namespace loopwarden::diagnosis {

inline constexpr std::array kFeatureNames{
    // oscillation and time scale
    std::string_view("pv_regularity"), std::string_view("co_regularity"),
    std::string_view("pv_peak"), std::string_view("co_peak"),
    std::string_view("log_samples_per_period"),
    // record
    std::string_view("noise_share"), std::string_view("held_share"),
    std::string_view("share_at_limit"),
    // correlation and controller
    std::string_view("xc_at_zero"), std::string_view("xc_odd_share"),
    std::string_view("xc_strength"), std::string_view("phase_cos"), std::string_view("phase_sin"),
    std::string_view("coherence"), std::string_view("integral_share"),
    std::string_view("controller_fit"),
    // waveforms
    std::string_view("co_sine_error"), std::string_view("co_sine_over_triangle"),
    std::string_view("co_kurtosis"), std::string_view("co_third"), std::string_view("co_second"),
    std::string_view("co_repeats"), std::string_view("pv_sine_error"),
    std::string_view("pv_sine_over_flat"), std::string_view("pv_sine_over_triangle"),
    std::string_view("pv_kurtosis"), std::string_view("pv_third"),
    std::string_view("pv_third_across"), std::string_view("pv_second"),
    std::string_view("pv_repeats"), std::string_view("pv_area"),
    std::string_view("slope_sine_over_flat"), std::string_view("slope_kurtosis"),
    std::string_view("slope_third"),
    // dwelling
    std::string_view("co_concentration"), std::string_view("pv_concentration"),
    std::string_view("pv_over_co_concentration"), std::string_view("pv_late"),
    std::string_view("pv_sticky_words"), std::string_view("pv_sticky_pairs"),
    std::string_view("pv_tails"), std::string_view("co_tails"),
    std::string_view("tails_difference"), std::string_view("loop_area"),
    std::string_view("co_travel_scatter"), std::string_view("co_duration_scatter"),
    std::string_view("slope_concentration"), std::string_view("slope_sticky_words"),
    std::string_view("slope_tails"), std::string_view("pv_skewness"),
    std::string_view("pv_step_skewness"),
    // fits
    std::string_view("linear_free"), std::string_view("backlash_free"),
    std::string_view("stiction_free"), std::string_view("stiction_gain_free"),
    std::string_view("linear_whitened"), std::string_view("stiction_whitened"),
    std::string_view("stiction_gain_whitened"), std::string_view("jump_gain_free"),
    std::string_view("jump_gain_whitened"), std::string_view("integrating"),
    std::string_view("fit_dead_time"), std::string_view("fit_band"), std::string_view("fit_jump"),
    std::string_view("fit_time_constant")};

inline constexpr std::size_t kFeatures = kFeatureNames.size();
using Features = std::array<double, kFeatures>;

// Position of a name in the list; a name that isn't there does not compile.
consteval std::size_t feature_index(std::string_view name) {
  for (std::size_t i = 0; i < kFeatures; ++i) {
    if (kFeatureNames[i] == name) return i;
  }
  throw "no feature of this name";
}

struct FeaturesAndFit {
  Features features{};
  ValveFit fit;
};

// `prepared` must not carry a refusal.
FeaturesAndFit find_features(const Prepared& prepared);

}  // namespace loopwarden::diagnosis
