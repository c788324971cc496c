// SPDX-License-Identifier: Apache-2.0
// What an archive kept of a signal. Historians store a value only when it tells something new:
//
//   exception       when it left the last stored one by more than a dead band; in between it is within the band around
//                   that: the last value holds
//   swinging door   when no straight line from the last stored one stays within a deviation of all that came since
//                   (E. H. Bristol, ISA 1990); in between the line is within the deviation: straight lines
//
// Recognised by what they leave:
//
//   exception       the smallest differences of successive stored values lie close together, at the band: band = their
//                   2 % quantile
//   swinging door   small differences occur as well. A stored value B between A and C that was followed by C at once was
//                   stored because of C: |B - chord AC| > deviation. Deviation = the 5 % quantile of these / 0.9; where
//                   C came at once in fewer than eight places, 0.9 of the lower quartile of all |B - chord AC|.
//
// In a record on a constant period that a historian has filled again, the stored values are the ends of runs of repeats
// or of straight lines, exact but for the digits. Only a record most of whose samples lie on such runs is taken for one:
// quantised, held and constant signals have runs too, and are told from it by their steps, which are multiples of one
// size or come at equal intervals.
//
// Ranges: at least 20 stored values. Errors: none; what is not recognised is `none`, or `unknown` where values are
// missing in the way of an archive but fit neither kind.
// On the industrial records in data/, thinned by both: band within 10 % where less than half of the values were kept;
// deviation within 0.5 to 1.5 with values stored at once, else within a factor of three.
// What it can't do: say what was lost. A signal that was averaged before it was stored is not recognised.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace loopwarden::analysis {

enum class ArchiveKind : std::uint8_t { none, exception, swinging_door, unknown };
const char* to_text(ArchiveKind kind) noexcept;

struct ArchivedSignal {
  ArchiveKind kind = ArchiveKind::none;
  double deviation = 0.0;     // units of the signal: dead band or deviation; 0 where not known
  double stored_share = 1.0;  // of the samples
};

// Of stored values at their times, s, rising. `tick_s`: shortest distance at which values were looked at.
ArchivedSignal recognise_stored(std::span<const double> time_s, std::span<const double> values,
                                double tick_s);
// Of a record on a constant period; NaN is missing.
ArchivedSignal recognise_filled(std::span<const double> values);

// Places of the stored values in a record on a constant period, for recognise_filled.
struct Runs {
  std::vector<std::size_t> ends;  // first sample, then the last of every run
  double straight_share = 0.0;    // of the samples, inside runs of four and more that rise or fall
  double flat_share = 0.0;        // inside runs of repeats
};
Runs find_runs(std::span<const double> values);

}  // namespace loopwarden::analysis
