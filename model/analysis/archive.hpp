// SPDX-License-Identifier: Apache-2.0
// Recognises how a historian compressed a signal. Historians use two rules to store a value:
//
//   exception       The value differs from the last stored value by more than a dead band. Between
//                   stored values the signal is within the band around the last stored value, so
//                   the last value is held.
//   swinging door   No straight line from the last stored value stays within a deviation of all
//                   values since then (E. H. Bristol, ISA 1990). Between stored values the line is
//                   within the deviation, so straight lines are used.
//
// The rules are recognised by these signs:
//
//   exception       The smallest differences of successive stored values are close together, at the
//                   band. Band = their 2 % quantile.
//   swinging door   Small differences occur as well. If a stored value B is followed immediately by
//                   C, it was stored because of C: |B - chord AC| > deviation; A precedes B.
//                   Deviation = 5 % quantile of these distances / 0.9. If fewer than eight values
//                   were followed immediately, it is 0.9 of the lower quartile of |B - chord AC|
//                   for all values.
//                   If the distances reach down to 0 (5 % quantile below a third of the median), no
//                   swinging door stored the values, and the kind is `unknown`.
//
// A historian can fill a record on a constant period again. Then the stored values are the ends of
// repeats or of straight lines, exact to the last written digit. Signs of lines: more samples than
// by chance are on the line between their neighbours, and the other samples are far from it.
// Repeats also occur in quantised, held and constant signals. Their steps are multiples of one size
// or have equal intervals, unlike those of an archive. Repeats don't count as an archive if the
// steps are those of a converter, or if the signal returns to few levels. Examples are integers,
// and an output that is stepped manually between the same values.
//
// Ranges: at least 20 stored values.
// Errors: no exceptions; an unrecognised signal has the kind `none`, or `unknown` if values are
// missing as in an archive but fit neither rule.
//
// Accuracy on industrial records (examples/), thinned by both rules: the band is within 10 % if
// less than half of the values were stored. The deviation is within a factor of 0.5 to 1.5 if
// values were stored immediately after each other, otherwise within a factor of three.
//
// Limits: it can't reconstruct the lost values. A signal that was averaged before it was stored
// isn't recognised.
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
  double deviation = 0.0;     // units of the signal: dead band or deviation; 0: unknown
  double stored_share = 1.0;  // share of the samples that were stored
  bool held_lines = false;    // stored by swinging door, but held instead of joined by lines
};

// Recognises the rule from stored values and their rising times, s. `tick_s`: shortest scan
// interval, s.
ArchivedSignal recognise_stored(std::span<const double> time_s, std::span<const double> values,
                                double tick_s);
// Recognises the rule from a record on a constant period; NaN is a missing sample.
ArchivedSignal recognise_filled(std::span<const double> values);

// Returns the samples at which the straight lines through all of `values` begin and end, exact to
// the last digit.
std::vector<std::size_t> run_ends(std::span<const double> values);

// Returns an estimate of the signal for held values that were stored by exception. The true values
// are within the dead band around the held value and approach the next one.
std::vector<double> within_band(std::span<const double> held, double dead_band);

// Returns the same for held_lines: straight lines between the samples at which the values begin.
std::vector<double> lines_for_steps(std::span<const double> held);

}  // namespace loopwarden::analysis
