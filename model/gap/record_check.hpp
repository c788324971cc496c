// SPDX-License-Identifier: Apache-2.0
// Is the record fit to be believed? Missing and frozen samples, saturation, too little movement,
// rounding, and the noise that the record itself shows:
//
//   noise = 1.4826 median |y(k+1) - 2 y(k) + y(k-1)| / sqrt(6)
//
// which a slow signal does not move and outliers hardly (for Gaussian noise it is its standard
// deviation; rounding is part of it). Between values at uneven times, y1 off the line from y0 to y2
// by
// 1.4826 median / sqrt(1 + w^2 + (1 - w)^2), w being y1's place between them. Where rounding hides
// the noise, resolution / sqrt(12) stands in.
//
// Source of the median's factor: Huber, Robust Statistics (1981).
#pragma once

#include "model/gap/constants.hpp"
#include "model/gap/record.hpp"
#include "model/gap/result.hpp"

namespace loopwarden::gap {

// The record with what no transmitter of this range can have sent, a span or more outside, taken as
// missing.
LoopRecord believed(LoopRecord record, const plant::LoopModel& model);

RecordCheck check_record(const LoopRecord& record, const plant::LoopModel& model);

// Samples of PV that count: measured, and not in the wake of a CO that was not.
std::vector<bool> usable_samples(const LoopRecord& record, const plant::LoopModel& model);

// The column with gaps closed by the value before (at the start: the first there is).
std::vector<double> held(const std::vector<double>& column);

// Smallest difference that occurs between neighbours, 0 if the values are all alike or not stepped.
double resolution_of(const std::vector<double>& column);

// Samples at which a column turns by more than `band` (same units).
std::vector<std::size_t> reversals(const std::vector<double>& column, double band);

// Noise of a column as above; 0 if it never moves.
double noise_of(const std::vector<double>& column);
// The same of a column of which values stand only here and there.
double noise_of_stored(const std::vector<double>& column);

}  // namespace loopwarden::gap
