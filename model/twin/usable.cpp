// SPDX-License-Identifier: Apache-2.0
#include "model/twin/usable.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "model/analysis/archive.hpp"
#include "model/numeric/statistics.hpp"
#include "model/numeric/text.hpp"

namespace loopwarden::twin {
namespace {

using numeric::text;

constexpr double kSame = 1e-5;  // of the range that PV moves over
// Changes that are this much alike are one step.
constexpr double kSameStep = 0.25;

double share(std::size_t part, std::size_t of) {
  return of > 0 ? static_cast<double>(part) / static_cast<double>(of) : 0.0;
}

// Of the changes between neighbours that are not 0: are they mostly the least one?
bool all_one_step(std::vector<double> changes) {
  if (changes.empty()) return true;
  std::sort(changes.begin(), changes.end());
  const double step = changes[changes.size() / 20];
  const auto alike = std::count_if(changes.begin(), changes.end(),
                                   [&](double c) { return c < (1.0 + kSameStep) * step; });
  return 2 * static_cast<std::size_t>(alike) > changes.size();
}

}  // namespace

std::string why_compressed(const numeric::LoopRecord& record) {
  const numeric::Range range = numeric::range_of(record.pv);
  const double tiny = kSame * (range.high - range.low);
  if (!(tiny > 0.0)) return "PV never moves.";
  const analysis::ArchivedSignal kept = analysis::recognise_filled(record.pv);
  if (kept.kind != analysis::ArchiveKind::none && kept.stored_share < kLeastStored) {
    return text(
        "The record is compressed: %.0f %% of PV's samples were stored, between them %s. Export "
        "raw samples, with compression and exception reporting off.",
        100.0 * kept.stored_share,
        kept.kind == analysis::ArchiveKind::swinging_door && !kept.held_lines
            ? "are straight lines"
            : "the last value is held");
  }
  std::size_t seen = 0;
  std::size_t still = 0;
  std::vector<double> changes;
  for (std::size_t k = 1; k < record.size(); ++k) {
    const double change = std::abs(record.pv[k] - record.pv[k - 1]);
    if (!std::isfinite(change)) continue;
    ++seen;
    if (change <= tiny) {
      ++still;
    } else {
      changes.push_back(change);
    }
  }
  if (share(still, seen) > kMostStill && !all_one_step(std::move(changes))) {
    return text(
        "%.0f %% of PV's samples repeat the previous one, and the other changes have many sizes: "
        "PV "
        "was stored more often than it was measured. Record the raw values of the transmitter, "
        "without averages or holds.",
        100.0 * share(still, seen));
  }
  return "";
}

std::string why_by_hand(const std::vector<double>& automatic) {
  std::size_t by_hand = 0;
  std::size_t known = 0;
  for (const double v : automatic) {
    if (!std::isfinite(v)) continue;
    ++known;
    if (v == 0.0) ++by_hand;
  }
  if (share(by_hand, known) <= kMostByHand) return "";
  return text(
      "The loop was in manual in %.0f %% of the record. A twin needs a record in automatic.",
      100.0 * share(by_hand, known));
}

std::string why_clamped(const numeric::LoopRecord& record, const Spans& spans) {
  const double margin = 0.002 * (spans.co_high - spans.co_low);
  std::size_t at_end = 0;
  std::size_t known = 0;
  for (const double u : record.co) {
    if (!std::isfinite(u)) continue;
    ++known;
    if (u <= spans.co_low + margin || u >= spans.co_high - margin) ++at_end;
  }
  if (share(at_end, known) <= kMostClamped) return "";
  return text(
      "CO is at a limit of its range in %.0f %% of the record: the loop is open there, and "
      "the record doesn't show the valve.",
      100.0 * share(at_end, known));
}

std::string why_still(const numeric::LoopRecord& record, const Spans& spans) {
  const bool by_sp = record.has_sp();
  const std::vector<double>& column = by_sp ? record.sp : record.co;
  const double span = by_sp ? spans.pv_high - spans.pv_low : spans.co_high - spans.co_low;
  const double least = kLeastMove * span;
  int moves = 0;
  double place = std::nan("");
  for (const double v : column) {
    if (!std::isfinite(v)) continue;
    if (!std::isfinite(place)) place = v;
    if (std::abs(v - place) >= least) {
      ++moves;
      place = v;
    }
  }
  if (moves >= kFewestMoves) return "";
  return text(
      "%s moves %s by %.0f %% of its span or more: the effect of CO on PV can't be separated from "
      "the load. "
      "Step the set point by 3 to 5 %% of its span twice in each direction, each step held until "
      "PV has settled.",
      by_sp ? "SP" : "CO", moves == 0 ? "never" : "only once", 100.0 * kLeastMove);
}

std::string why_short(const numeric::LoopRecord& record) {
  const double seconds = static_cast<double>(record.size()) * record.period_s;
  if (seconds >= kShortest_s) return "";
  return text(
      "The record is %.1f minutes long; at least %.0f are required (--accept-short accepts it).",
      seconds / 60.0, kShortest_s / 60.0);
}

}  // namespace loopwarden::twin
