// SPDX-License-Identifier: Apache-2.0
#include "model/gap/check.hpp"

#include <algorithm>
#include <utility>

#include "model/gap/constants.hpp"
#include "model/gap/controller.hpp"
#include "model/gap/model_run.hpp"
#include "model/gap/record_check.hpp"
#include "model/numeric/text.hpp"
#include "model/plant/plant.hpp"

namespace loopwarden::gap {
namespace {

using numeric::text;

std::vector<double> assumed_set_point(const plant::LoopModel& model, const std::vector<double>& pv,
                                      std::vector<RecordNote>& notes) {
  const std::size_t n = pv.size();
  const auto& profile = model.scenario.set_point;
  if (profile.empty()) {
    double mean = 0.0;
    const std::size_t half = n / 2;
    for (std::size_t k = half; k < n; ++k) mean += pv[k] / static_cast<double>(n - half);
    notes.push_back(
        {"no set point", text("SP was not measured and the model has no scenario: %.4g, "
                              "the mean of PV's second half, stands for it",
                              mean)});
    return std::vector<double>(n, mean);
  }
  const auto shifted = [&](double shift_s) {
    std::vector<double> sp(n, profile.front().second);
    for (std::size_t k = 0; k < n; ++k) {
      for (const auto& [time_s, value] : profile) {
        if (static_cast<double>(k) * model.sample_time_s + 1e-9 >= time_s + shift_s) sp[k] = value;
      }
    }
    return sp;
  };
  double best_shift_s = 0.0;
  double best = -1.0;
  for (int i = -100; i <= 100; ++i) {
    const double shift_s = i * model.sample_time_s;
    const std::vector<double> simulated = closed_loop(model, shifted(shift_s), pv.front());
    double sum = 0.0;
    for (std::size_t k = 0; k < n; ++k) sum += (pv[k] - simulated[k]) * (pv[k] - simulated[k]);
    if (best < 0.0 || sum < best) {
      best = sum;
      best_shift_s = shift_s;
    }
  }
  notes.push_back(
      {"no set point", text("SP was not measured: the scenario's profile, %.3g s later, "
                            "stands for it",
                            best_shift_s)});
  return shifted(best_shift_s);
}

// Those used that are neither repeated nor at an end of what the transmitter shows; all, where that
// leaves too few to fit anything to.
std::vector<bool> measured_samples(const CheckedRecord& r) {
  const plant::TransmitterParameters& range = r.model.transmitter;
  const double margin = kAtEnd * range.span();
  const auto [lowest, highest] = std::minmax_element(r.pv.begin(), r.pv.end());
  // A range that the record goes beyond is not the transmitter's.
  const bool ends_low = *lowest >= range.low;
  const bool ends_high = *highest <= range.high;
  std::vector<bool> measured = r.used;
  std::size_t count = 0;
  for (std::size_t k = 0; k < r.pv.size(); ++k) {
    if (!r.reading.measured[k] || (ends_low && r.pv[k] <= range.low + margin) ||
        (ends_high && r.pv[k] >= range.high - margin)) {
      measured[k] = false;
    }
    if (measured[k] && k < training_samples(r.pv.size())) ++count;
  }
  return count < kFewestMeasured ? r.used : measured;
}

// The longest spike, samples: shorter than the process's lag at its least; 0 where that is too fast
// to tell.
std::size_t longest_spike(const plant::LoopModel& model) {
  if (model.process.integrating()) return kLongestSpike;
  const double lag = model.process.time_constant_s *
                     std::max(0.0, 1.0 - model.uncertainty.time_constant) / model.sample_time_s;
  return lag < kSpikeLag ? 0 : std::min(kLongestSpike, static_cast<std::size_t>(lag));
}

// Samples in spikes don't count.
void take_spikes_out(CheckedRecord& out, const std::vector<double>& pv) {
  if (out.reading.held || !(out.quality.noise_rms > 0.0)) return;
  const double least =
      std::max(kSpikeNoise * out.quality.noise_rms, kSpikeSpan * out.model.transmitter.span());
  out.reading.spikes = find_spikes(pv, least, longest_spike(out.model));
  if (out.reading.spikes.count == 0) return;
  for (std::size_t k = 0; k < pv.size(); ++k) {
    if (out.reading.spikes.at[k]) out.used[k] = false;
  }
  out.quality.notes.push_back({"spikes", text("%zu samples of PV in %zu spikes of %.3g: skipped",
                                              out.reading.spikes.samples, out.reading.spikes.count,
                                              out.reading.spikes.size)});
}

}  // namespace

CheckedRecord check(const LoopRecord& given, const plant::LoopModel& model) {
  CheckedRecord out;
  LoopRecord record = believed(given, model);
  out.quality = check_record(record, model);
  if (!out.quality.usable) return out;

  out.model = model;
  out.model.sample_time_s = record.period_s;
  out.model.transmitter.noise = 0.0;
  out.model.transmitter.resolution = 0.0;
  out.pv = held(record.pv);
  if (record.has_sp()) out.sp = held(record.sp);
  if (!record.has_co()) {
    out.closed_loop = true;
    if (out.sp.empty()) out.sp = assumed_set_point(out.model, out.pv, out.quality.notes);
    plant::Plant rest(out.model, 1);
    record.co = replay_controller(out.model.controller.pid, out.model.sample_time_s, out.sp, out.pv,
                                  rest.output_for(out.pv.front()));
    out.quality.notes.push_back(
        {"no output",
         "CO was not measured: the model's controller, replayed on SP and PV, stands for it"});
  }
  out.co = held(record.co);
  out.used = usable_samples(record, out.model);
  out.training_end = training_samples(record.size());
  out.reading = examine_reading(record.pv);
  if (!record.pv_as_stored) take_spikes_out(out, record.pv);
  out.measured = measured_samples(out);
  // What stands at an end or is repeated hides the noise. Of a held reading only the renewals are
  // left, one by one.
  std::vector<double> measurements;
  for (std::size_t k = 0; k < record.size(); ++k) {
    if (out.measured[k]) {
      measurements.push_back(record.pv[k]);
    } else if (!out.reading.held) {
      measurements.push_back(kNone);
    }
  }
  if (out.measured != out.used && !record.pv_as_stored) {
    out.quality.noise_rms = noise_of(measurements);
  }
  out.training = out.measured;
  std::fill(out.training.begin() + static_cast<std::ptrdiff_t>(out.training_end),
            out.training.end(), false);
  out.record = std::move(record);
  return out;
}

}  // namespace loopwarden::gap
