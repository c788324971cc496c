// SPDX-License-Identifier: Apache-2.0
// First stage: is the record to be believed, and what of it is used.
//
// Takes the record and the model as given; gives the columns with their gaps closed, the samples
// that count, and the model as it is fitted: at the record's period, without noise and rounding.
// Where CO was not measured, the model's controller, replayed on SP and PV, stands for it; where SP
// was not, the scenario's profile, shifted in time to where PV agrees best with the model's closed
// loop, or the mean of the record's second half.
//
// What it can't do: without a measured CO a wrong tuning in the model looks like a fault of the
// plant.
#pragma once

#include <cstddef>
#include <vector>

#include "model/gap/reading.hpp"
#include "model/gap/record.hpp"
#include "model/gap/result.hpp"

namespace loopwarden::gap {

struct CheckedRecord {
  RecordCheck quality;             // with `usable` false the rest is empty
  LoopRecord record;               // what can't have been measured taken out; CO as it is used
  plant::LoopModel model;          // quiet, at the record's period
  bool closed_loop = false;        // CO was not measured
  std::vector<double> pv, sp, co;  // gaps closed; sp empty where nobody knows it
  ReadingFinding reading;          // what PV's flat places say
  std::vector<bool> used;          // samples of PV that count
  std::vector<bool> measured;      // those that are no mere bound or repetition
  std::vector<bool> training;      // those of the first two thirds
  std::size_t training_end = 0;    // first sample of the holdout
};

CheckedRecord check(const LoopRecord& given, const plant::LoopModel& model);

}  // namespace loopwarden::gap
