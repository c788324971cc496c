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
//                   Where these reach down to 0 (5 % quantile below a third of the median) no door stored them: `unknown`.
//
// In a record on a constant period that a historian has filled again, the stored values are the ends of repeats or of
// straight lines, exact to the last digit that was written. For lines: more of the samples lie on the line between
// their neighbours than chance would have there, and those that do not lie far off it. For repeats: quantised, held and
// constant signals have them too, and are told from an archive's by their steps, which are multiples of one size or come
// at equal intervals. Repeats are not an archive's if the signal comes back to few levels
// (integers, an output that is stepped by hand between the same values) or if its steps are those
// of a converter.
//
// Ranges: at least 20 stored values. Errors: no exceptions; what is not recognised is `none`, or `unknown` where values are
// missing in the way of an archive but fit neither kind.
// On the industrial records in data/, thinned by both: band within 10 % where less than half of the values were kept;
// deviation within 0.5 to 1.5 with values stored at once, else within a factor of three.
// Limits: say what was lost. A signal that was averaged before it was stored is not recognised.
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
  bool held_lines = false;    // stored by swinging door, and held where a straight line belongs
};

// Of stored values at their times, s, rising. `tick_s`: shortest distance at which values were looked at.
ArchivedSignal recognise_stored(std::span<const double> time_s, std::span<const double> values,
                                double tick_s);
// Of a record on a constant period; NaN is missing.
ArchivedSignal recognise_filled(std::span<const double> values);

// The samples at which straight lines through all of `values` begin and end, exact to the last
// digit.
std::vector<std::size_t> run_ends(std::span<const double> values);

// Values that were stored by exception and are held: the true ones are within the dead band around what is held, and on
// their way to the next.
std::vector<double> within_band(std::span<const double> held, double dead_band);

// The same for held_lines: straight lines from where one value begins to where the next does.
std::vector<double> lines_for_steps(std::span<const double> held);

}  // namespace loopwarden::analysis
