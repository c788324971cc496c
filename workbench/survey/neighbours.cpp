// SPDX-License-Identifier: Apache-2.0
#include "workbench/survey/neighbours.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <tuple>

#include "base/parallel.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::workbench {
namespace {

using diagnosis::Cause;
using diagnosis::DiagnosisVerdict;
using nlohmann::json;

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kLeastOverlap = 400;  // samples
// Number of pairs that are compared closely: about one per loop, which takes a tenth of the time of
// judging the loop. In a large plant it is smaller.
constexpr std::size_t kLeastPairs = 45;
constexpr std::size_t kMostPairs = 500;

std::int64_t place_of(const TimedLoop& loop) { return std::llround(loop.first_s / loop.step_s); }

std::int64_t end_of(const TimedLoop& loop) {
  return place_of(loop) + static_cast<std::int64_t>(loop.pv.size());
}

// Loops whose samples are compared directly.
struct Together {
  std::int64_t from = 0;
  std::size_t samples = 0;
  std::vector<std::size_t> loops;
};

// Groups the loops of a time base. A group has the loops that end last and share at least half of
// their time with the last one. The remaining loops are grouped in the same way.
void add_together(std::span<const TimedLoop> all, std::vector<std::size_t> loops,
                  std::vector<Together>& out) {
  std::stable_sort(loops.begin(), loops.end(),
                   [&](std::size_t a, std::size_t b) { return end_of(all[a]) > end_of(all[b]); });
  while (loops.size() > 1) {
    const std::int64_t to = end_of(all[loops.front()]);
    std::size_t longest = 0;
    for (const std::size_t k : loops) {
      if (end_of(all[k]) == to) longest = std::max(longest, all[k].pv.size());
    }
    Together one{to - static_cast<std::int64_t>(longest), longest, {}};
    std::vector<std::size_t> rest;
    for (const std::size_t k : loops) {
      const std::int64_t common = end_of(all[k]) - std::max(one.from, place_of(all[k]));
      (2 * common >= static_cast<std::int64_t>(longest) ? one.loops : rest).push_back(k);
    }
    if (one.loops.size() > 1 && longest >= kLeastOverlap) out.push_back(std::move(one));
    if (rest.size() == loops.size()) return;
    loops = std::move(rest);
  }
}

std::vector<Together> together(std::span<const TimedLoop> all) {
  using Base = std::tuple<std::int64_t, bool, bool, double, double>;
  std::map<Base, std::vector<std::size_t>> by_base;
  for (std::size_t k = 0; k < all.size(); ++k) {
    const TimedLoop& loop = all[k];
    by_base[{std::llround(loop.step_s * 1e6), loop.clock, loop.zone_known,
             loop.clock ? 0.0 : loop.from_s, loop.clock ? 0.0 : loop.to_s}]
        .push_back(k);
  }
  std::vector<Together> out;
  for (auto& [base, loops] : by_base) add_together(all, std::move(loops), out);
  return out;
}

diagnosis::LoopMoves moves_within(const TimedLoop& loop, const Together& frame) {
  const auto placed = [&](const std::vector<float>& x) {
    std::vector<double> out(frame.samples, kMissing);
    const std::int64_t at = place_of(loop) - frame.from;
    for (std::size_t k = 0; k < x.size(); ++k) {
      const std::int64_t to = at + static_cast<std::int64_t>(k);
      if (to >= 0 && to < static_cast<std::int64_t>(out.size()))
        out[static_cast<std::size_t>(to)] = static_cast<double>(x[k]);
    }
    return out;
  };
  return diagnosis::moves_of(placed(loop.pv), placed(loop.co));
}

// Computes the moves of a loop again for each pair, so that a large plant needs little memory.
void compare(std::span<const TimedLoop> all, const Together& frame, unsigned threads,
             std::vector<Neighbours>& found) {
  std::vector<diagnosis::NeighbourLoop> looked_at(frame.loops.size());
  base::parallel_for(looked_at.size(), threads, [&](std::size_t k) {
    const TimedLoop& loop = all[frame.loops[k]];
    looked_at[k] = {diagnosis::summed_moves(moves_within(loop, frame)), loop.period_s};
  });
  const auto pairs =
      diagnosis::pairs_to_look_at(looked_at, std::clamp(looked_at.size(), kLeastPairs, kMostPairs));
  std::vector<std::array<std::optional<diagnosis::Push>, 2>> pushes(pairs.size());
  base::parallel_for(pairs.size(), threads, [&](std::size_t k) {
    const TimedLoop& a = all[frame.loops[pairs[k].first]];
    const TimedLoop& b = all[frame.loops[pairs[k].second]];
    const diagnosis::LoopMoves of_a = moves_within(a, frame);
    const diagnosis::LoopMoves of_b = moves_within(b, frame);
    pushes[k] = {diagnosis::push(of_a, a.valve_effect, of_b),
                 diagnosis::push(of_b, b.valve_effect, of_a)};
  });
  for (const std::size_t k : frame.loops) found[k].compared = true;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const std::size_t a = frame.loops[pairs[k].first];
    const std::size_t b = frame.loops[pairs[k].second];
    if (pushes[k][0]) found[b].pushed_by.push_back({a, *pushes[k][0]});
    if (pushes[k][1]) found[a].pushed_by.push_back({b, *pushes[k][1]});
  }
}

struct Extent {
  double low = 0.0, high = 0.0;

  double span() const noexcept { return high - low; }
  bool like(const Extent& other) const noexcept {
    constexpr double kExtentTolerance = 0.1;  // of the span; a coarser record misses peaks
    const double most = kExtentTolerance * std::max(span(), other.span());
    return std::abs(low - other.low) <= most && std::abs(high - other.high) <= most;
  }
};

Extent extent_of(const std::vector<float>& x) {
  const auto [low, high] = numeric::range_of(std::vector<double>(x.begin(), x.end()));
  return {low, high};
}

// Samples of two records at the same times.
struct Pairs {
  std::vector<double> a, b;
};

// Pairs the samples of the coarser record with those of the other. `shift_s`: of b's clock.
Pairs paired(const TimedLoop& coarse, const std::vector<float>& a, const TimedLoop& fine,
             const std::vector<float>& b, double shift_s) {
  Pairs out;
  for (std::size_t k = 0; k < a.size(); ++k) {
    const double at =
        (coarse.first_s + static_cast<double>(k) * coarse.step_s - fine.first_s - shift_s) /
        fine.step_s;
    const double nearest = std::round(at);
    if (nearest < 0.0 || nearest >= static_cast<double>(b.size()) || !std::isfinite(a[k])) continue;
    const float other = b[static_cast<std::size_t>(nearest)];
    if (!std::isfinite(other)) continue;
    out.a.push_back(static_cast<double>(a[k]));
    out.b.push_back(static_cast<double>(other));
  }
  return out;
}

bool same_values(const Pairs& pairs) {
  const double mean = numeric::mean(pairs.a);
  double error = 0.0;
  double size = 0.0;
  for (std::size_t k = 0; k < pairs.a.size(); ++k) {
    error += (pairs.a[k] - pairs.b[k]) * (pairs.a[k] - pairs.b[k]);
    size += (pairs.a[k] - mean) * (pairs.a[k] - mean);
  }
  return error <= kSameRecord * kSameRecord * size;
}

// Returns whether most moves are the same. Two loops with the same set points have different noise.
bool same_moves(const Pairs& pairs) {
  constexpr double kMostOfThem = 0.8;
  constexpr double kLikeness = 0.5;  // of the median move
  const std::size_t longest = std::max<std::size_t>(1, pairs.a.size() / 100);
  for (std::size_t lag = 1; lag <= longest; lag *= 2) {
    std::vector<double> sizes;
    for (std::size_t k = lag; k < pairs.a.size(); ++k)
      sizes.push_back(std::abs(pairs.a[k] - pairs.a[k - lag]));
    const double usual = numeric::median(sizes);
    if (!(usual > 0.0)) continue;  // a coarse converter: over a longer time
    std::size_t same = 0;
    for (std::size_t k = lag; k < pairs.a.size(); ++k) {
      const double of_a = pairs.a[k] - pairs.a[k - lag];
      const double of_b = pairs.b[k] - pairs.b[k - lag];
      same += std::abs(of_a - of_b) <= kLikeness * usual ? 1U : 0U;
    }
    return static_cast<double>(same) >= kMostOfThem * static_cast<double>(sizes.size());
  }
  return false;
}

bool same_record(const TimedLoop& a, const TimedLoop& b) {
  const bool a_is_coarse = a.step_s >= b.step_s;
  const TimedLoop& coarse = a_is_coarse ? a : b;
  const TimedLoop& fine = a_is_coarse ? b : a;
  const auto end = [](const TimedLoop& loop) {
    return loop.first_s + static_cast<double>(loop.pv.size() - 1) * loop.step_s;
  };
  std::vector<double> shifts;
  if (coarse.clock && fine.clock) shifts.push_back(0.0);
  // Without a clock, or with one of another zone: records of one length have one end.
  if (std::abs((a.to_s - a.from_s) - (b.to_s - b.from_s)) <= coarse.step_s)
    shifts.push_back(end(coarse) - end(fine));
  for (const double shift_s : shifts) {
    const Pairs pv = paired(coarse, coarse.pv, fine, fine.pv, shift_s);
    if (pv.a.size() < kLeastOverlap || 2 * pv.a.size() < coarse.pv.size()) continue;
    if (same_values(pv) && same_moves(pv) &&
        same_values(paired(coarse, coarse.co, fine, fine.co, shift_s)))
      return true;
  }
  return false;
}

// Two characters per value; 0 is a missing value.
constexpr std::string_view kDigits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
constexpr int kLevels = 64 * 64 - 1;

json packed(const std::vector<float>& x) {
  const auto [low, high] = numeric::range_of(std::vector<double>(x.begin(), x.end()));
  std::string text;
  for (const float v : x) {
    const int level = !std::isfinite(v) ? 0
                      : high > low
                          ? 1 + static_cast<int>(std::lround((static_cast<double>(v) - low) /
                                                             (high - low) * (kLevels - 1)))
                          : 1;
    text += kDigits[static_cast<std::size_t>(level / 64)];
    text += kDigits[static_cast<std::size_t>(level % 64)];
  }
  return {{"low", low}, {"high", high}, {"values", text}};
}

std::vector<float> unpacked(const json& in) {
  const double low = in.at("low").get<double>();
  const double high = in.at("high").get<double>();
  const std::string& text = in.at("values").get_ref<const std::string&>();
  std::vector<float> x;
  x.reserve(text.size() / 2);
  for (std::size_t k = 0; k + 1 < text.size(); k += 2) {
    const auto level = static_cast<int>(64 * kDigits.find(text[k]) + kDigits.find(text[k + 1]));
    x.push_back(static_cast<float>(level == 0 ? kMissing
                                              : low + (high - low) * (level - 1) / (kLevels - 1)));
  }
  return x;
}

TimedLoop timed_loop(const json& loop) {
  const json& moves = loop.at("moves");
  const json& period = loop.at("period_s");
  return {.tag = loop.at("tag").get<std::string>(),
          .step_s = moves.at("step_s").get<double>(),
          .first_s = moves.at("first_s").get<double>(),
          .clock = moves.at("clock").get<bool>(),
          .zone_known = moves.at("zone_known").get<bool>(),
          .from_s = moves.at("from_s").get<double>(),
          .to_s = moves.at("to_s").get<double>(),
          .pv = unpacked(moves.at("pv")),
          .co = unpacked(moves.at("co")),
          .valve_effect = loop.at("verdict") == "valve_effect",
          .period_s = period.is_number() ? period.get<double>() : 0.0};
}

bool is_cause(const json& loop, bool main) {
  const auto verdict = loop.at("verdict") == "healthy"       ? DiagnosisVerdict::healthy
                       : loop.at("verdict") == "other_cause" ? DiagnosisVerdict::other_cause
                                                             : DiagnosisVerdict::cant_tell;
  const auto cause = loop.at("cause") == "disturbance" ? Cause::disturbance
                     : loop.at("cause") == "tuning"    ? Cause::tuning
                                                       : Cause::none;
  return diagnosis::neighbour_is_cause(verdict, cause, main);
}

}  // namespace

TimedLoop timed_loop(const record::Record& record, const record::ImportNotes& notes,
                     std::size_t most) {
  const std::size_t first = record.size() - std::min(record.size(), most);
  TimedLoop loop{.tag = notes.tag,
                 .step_s = record.period_s,
                 .first_s = record.time_s[first],
                 .from_s = record.time_s.front(),
                 .to_s = record.time_s.back()};
  if (notes.start) {
    loop.clock = true;
    loop.zone_known = notes.start->zone_known;
    loop.first_s +=
        static_cast<double>(notes.start->whole_s) + notes.start->rest_s - record.time_s.front();
  }
  for (std::size_t k = first; k < record.size(); ++k) {
    const bool by_hand = !record.automatic.empty() && record.automatic[k] == 0.0;
    loop.pv.push_back(static_cast<float>(by_hand ? kMissing : record.pv[k]));
    loop.co.push_back(static_cast<float>(by_hand ? kMissing : record.co[k]));
  }
  return loop;
}

std::vector<Neighbours> find_neighbours(std::span<const TimedLoop> loops, unsigned threads) {
  std::vector<Neighbours> found(loops.size());
  for (const Together& frame : together(loops)) compare(loops, frame, threads, found);
  for (Neighbours& one : found) {
    std::sort(one.pushed_by.begin(), one.pushed_by.end(), [](const PushedBy& a, const PushedBy& b) {
      return std::tuple(!a.push.main(), -a.push.size, a.source) <
             std::tuple(!b.push.main(), -b.push.size, b.source);
    });
  }
  return found;
}

std::vector<std::size_t> find_duplicates(std::span<const TimedLoop> loops) {
  std::vector<std::size_t> order(loops.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto key = [&](std::size_t k) {
    const TimedLoop& loop = loops[k];
    return std::tuple(loop.from_s - loop.to_s, loop.step_s, loop.tag.size(),
                      std::string_view(loop.tag));
  };
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  std::vector<std::pair<Extent, Extent>> extents;  // PV and CO
  for (const TimedLoop& loop : loops) extents.emplace_back(extent_of(loop.pv), extent_of(loop.co));
  std::vector<std::size_t> of(loops.size());
  std::vector<std::size_t> originals;
  for (const std::size_t k : order) {
    of[k] = k;
    if (extents[k].first.span() > 0.0) {
      const auto same = std::find_if(originals.begin(), originals.end(), [&](std::size_t other) {
        return extents[k].first.like(extents[other].first) &&
               extents[k].second.like(extents[other].second) && same_record(loops[k], loops[other]);
      });
      if (same != originals.end()) {
        of[k] = *same;
        continue;
      }
    }
    originals.push_back(k);
  }
  return of;
}

std::string follows_text(const std::vector<std::string>& tags) {
  return fmt::format("PV follows the moves of {}", fmt::join(tags, ", "));
}

json moves_json(const record::Record& record, const record::ImportNotes& notes) {
  const TimedLoop loop = timed_loop(record, notes, kMovesKept);
  return {{"step_s", loop.step_s},         {"first_s", loop.first_s}, {"clock", loop.clock},
          {"zone_known", loop.zone_known}, {"from_s", loop.from_s},   {"to_s", loop.to_s},
          {"pv", packed(loop.pv)},         {"co", packed(loop.co)}};
}

void name_neighbours(std::vector<json>& loops, unsigned threads) {
  std::vector<TimedLoop> timed;
  std::vector<std::size_t> of;  // `loops`
  for (std::size_t k = 0; k < loops.size(); ++k) {
    loops[k]["pushed_by"] = nullptr;
    loops[k]["duplicate_of"] = nullptr;
    if (!loops[k].contains("moves")) continue;
    timed.push_back(timed_loop(loops[k]));
    loops[k].erase("moves");
    of.push_back(k);
  }
  const std::vector<std::size_t> original = find_duplicates(timed);
  for (std::size_t k = 0; k < timed.size(); ++k) {
    if (original[k] != k) loops[of[k]]["duplicate_of"] = timed[original[k]].tag;
  }
  for (std::size_t k = timed.size(); k-- > 0;) {
    if (original[k] == k) continue;
    timed.erase(timed.begin() + static_cast<std::ptrdiff_t>(k));
    of.erase(of.begin() + static_cast<std::ptrdiff_t>(k));
  }
  const std::vector<Neighbours> found = find_neighbours(timed, threads);
  for (std::size_t k = 0; k < found.size(); ++k) {
    if (!found[k].compared) continue;
    json& loop = loops[of[k]];
    std::vector<std::string> tags;
    std::vector<std::string> shown;
    for (const PushedBy& by : found[k].pushed_by) {
      tags.push_back(timed[by.source].tag);
      shown.push_back(loops[of[by.source]].value("shown", tags.back()));
    }
    loop["pushed_by"] = tags;
    if (tags.empty() || !is_cause(loop, found[k].pushed_by.front().push.main())) continue;
    loop["verdict"] = "other_cause";
    loop["cause"] = "neighbour";
    loop["evidence"] = follows_text(shown);
  }
}

}  // namespace loopwarden::workbench
