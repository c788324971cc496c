// SPDX-License-Identifier: Apache-2.0
// What PV's flat places say of the transmitter. Noise never gives the same value many times over,
// so that where PV is noisy elsewhere,
//
//   held     it changes at multiples of one interval only, by steps of unequal size: it is renewed then
//   clipped  it comes back to its highest (lowest) value again and again and stays there: it ends there
//
// Samples in between, and those at the end, bound PV instead of measuring it: nothing is fitted to
// them.
//
//   spikes   PV leaves its course within one sample and is back within one sample soon after: a process whose lag is
//            longer than both can't. Such samples are no part of the loop, and nothing is held against them
//            If more jumps stay than return, PV itself jumps, and the short ones are no spikes
//
// What it can't do: a reading to which noise is added behind the hold or the limit is not flat; an
// end that is reached once is no end. A record that a historian filled up at a fixed rate looks
// like a held one. Spikes that overlap, or that fade away, are not seen.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace loopwarden::gap {

struct HeldReading {
  double interval_samples = 0.0;
  double first_sample = 0.0;  // of a renewal, from 0 to interval_samples
  std::size_t renewals = 0;
};

struct Spikes {
  std::vector<bool> at;     // samples in one
  std::size_t count = 0;    // spikes
  std::size_t samples = 0;  // in all of them
  double size = 0.0;        // PV units, median
};

struct ReadingFinding {
  std::optional<HeldReading> held;
  std::optional<double> low, high;  // PV units, where it ends
  std::size_t at_low = 0;           // samples there
  std::size_t at_high = 0;
  std::vector<bool> measured;  // the samples at which PV was measured rather than bounded
  Spikes spikes;               // find_spikes()
};

// `pv` may have missing samples.
ReadingFinding examine_reading(const std::vector<double>& pv);

// Jumps by more than `least` (PV units) that are back after `longest` samples or fewer.
Spikes find_spikes(const std::vector<double>& pv, double least, std::size_t longest);

}  // namespace loopwarden::gap
