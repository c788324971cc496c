// SPDX-License-Identifier: Apache-2.0
// Segments of a simulated loop, as the recorder writes them.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <utility>
#include <vector>

#include "model/plant/simulated_loop.hpp"
#include "record/segment_format.hpp"
#include "record/segment_reader.hpp"

namespace loopwarden::tests {

inline constexpr std::int64_t kRecordStart_ms = 1'750'000'000'000;

// A lag of 8 s after 3 s of dead time with a gain of 1.5, run by PI. SP is a list of (s, PV units).
inline plant::LoopModel recorded_plant(std::vector<std::pair<double, double>> set_point) {
  plant::LoopModel model;
  model.sample_time_s = 0.5;
  model.process = {.gain = 1.5, .time_constant_s = 8.0, .dead_time_s = 3.0};
  model.controller.pid.gains = {.kp = 0.5, .ki = 0.05};
  model.controller.pid.output_high = model.controller.output.high = 100.0;
  model.controller.set_point.high = 100.0;
  model.transmitter.high = 100.0;
  model.transmitter.noise = 0.1;
  model.scenario.set_point = std::move(set_point);
  return model;
}

struct RecordedRun {
  std::uint64_t sequence = 1;
  std::int64_t start_ms = kRecordStart_ms;
  control::Mode mode = control::Mode::automatic;
};

inline void record_run(const std::filesystem::path& folder, const plant::LoopModel& model,
                       double seconds, const RecordedRun& run = {}) {
  std::filesystem::create_directories(folder);
  std::ofstream file(folder / record::segment_name(run.sequence), std::ios::binary);
  const auto header = record::encode(record::SegmentHeader{.sequence = run.sequence,
                                                           .run = run.sequence,
                                                           .loop = "FIC-101",
                                                           .period_s = model.sample_time_s,
                                                           .start_utc_ns = run.start_ms * 1'000'000,
                                                           .start_monotonic_ns = 0});
  file.write(header.bytes.data(), static_cast<std::streamsize>(header.bytes.size()));
  std::array<char, record::kSegmentRowBytes> bytes{};
  plant::SimulatedLoop loop(model);
  const auto count = static_cast<std::uint32_t>(seconds / model.sample_time_s);
  for (std::uint32_t i = 0; i < count; ++i) {
    const plant::LoopSample sample = loop.step();
    record::RecordRow row;
    row.time_ns = std::llround(i * model.sample_time_s * 1e9);
    row.period_index = i;
    row.sp = sample.sp;
    row.pv = sample.pv;
    row.co = sample.co;
    row.mode = run.mode;
    record::encode(row, i, header.crc, bytes);
    file.write(bytes.data(), bytes.size());
  }
}

}  // namespace loopwarden::tests
