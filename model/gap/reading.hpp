// SPDX-License-Identifier: Apache-2.0
// What PV's flat places say of the transmitter. Noise never gives the same value many times over, so
// that where PV is noisy elsewhere,
//
//   held     it changes at multiples of one interval only, by steps of unequal size: it is renewed then
//   clipped  it comes back to its highest (lowest) value again and again and stays there: it ends there
//
// Samples in between, and those at the end, bound PV instead of measuring it: nothing is fitted to them.
//
// What it can't do: a reading to which noise is added behind the hold or the limit is not flat; an end that
// is reached once is no end. A record that a historian filled up at a fixed rate looks like a held one.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

namespace loopwarden::gap {

struct HeldReading {
  double interval_samples = 0.0;
  double first_sample = 0.0;  // of a renewal, from 0 to interval_samples
  std::size_t renewals = 0;
};

struct ReadingFinding {
  std::optional<HeldReading> held;
  std::optional<double> low, high;  // PV units, where it ends
  std::size_t at_low = 0;           // samples there
  std::size_t at_high = 0;
  std::vector<bool> measured;  // the samples at which PV was measured rather than bounded
};

// `pv` may have missing samples.
ReadingFinding examine_reading(const std::vector<double>& pv);

}  // namespace loopwarden::gap
