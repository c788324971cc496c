// SPDX-License-Identifier: Apache-2.0
#include "model/commission/explain.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "model/commission/commission.hpp"
#include "model/effects/catalogue.hpp"
#include "model/gap/prove.hpp"
#include "model/monitor/twin_watch.hpp"

namespace loopwarden::commission {
namespace {

using monitor::AlarmKind;

// Blocks of the twin's residual, newest last.
struct ResidualBlock {
  std::size_t end = 0;  // sample behind it
  double size = 1.0;    // mean of the watch's two statistics
};

// The block from which on the residual is larger; 0: from the start, or nowhere.
std::size_t where_it_grows(const std::vector<ResidualBlock>& blocks) {
  constexpr std::size_t kFewest = 4;
  constexpr double kLarger = 2.0;
  if (blocks.size() < 2 * kFewest) return 0;
  std::vector<double> sum(blocks.size() + 1, 0.0);
  for (std::size_t i = 0; i < blocks.size(); ++i) sum[i + 1] = sum[i] + blocks[i].size;
  const auto mean = [&](std::size_t from, std::size_t to) {
    // A residual below the noise is the noise.
    return std::max(1.0, (sum[to] - sum[from]) / static_cast<double>(to - from));
  };
  std::size_t best = 0;
  double least = static_cast<double>(blocks.size()) * std::log(mean(0, blocks.size()));
  for (std::size_t i = kFewest; i + kFewest <= blocks.size(); ++i) {
    const double before = mean(0, i);
    const double after = mean(i, blocks.size());
    if (after < kLarger * before) continue;
    const double cost = static_cast<double>(i) * std::log(before) +
                        static_cast<double>(blocks.size() - i) * std::log(after);
    if (cost >= least) continue;
    least = cost;
    best = i;
  }
  return best;
}

const gap::FoundEffect* sure_effect(const Explanation& e) {
  if (e.result.outcome != gap::Outcome::missing_effect) return nullptr;
  if (std::isfinite(e.closed) && e.closed < kClosed) return nullptr;
  const auto found = std::find_if(e.result.effects.begin(), e.result.effects.end(),
                                  [](const auto& effect) { return effect.confidence >= kSure; });
  return found == e.result.effects.end() ? nullptr : &*found;
}

}  // namespace

gap::SampleRange telling_stretch(const gap::Record& record, const plant::LoopModel& twin,
                                 std::size_t alarm) {
  const auto samples = [&](double seconds) {
    return static_cast<std::size_t>(seconds / record.period_s);
  };
  const std::size_t longest = samples(kLongest_s);
  gap::SampleRange stretch{alarm > longest ? alarm - longest : 0,
                           std::min(record.size(), alarm + 1)};
  if (!record.has_co()) return stretch;
  monitor::TwinWatch watch(twin);
  std::vector<ResidualBlock> blocks;
  std::size_t quiet_until = stretch.begin;
  std::size_t began = 0;  // where the sums began to rise that reached the alarm; 0: they did not
  for (std::size_t k = stretch.begin; k < stretch.end; ++k) {
    if (!watch.add(record.pv[k], record.co[k])) continue;
    blocks.push_back({k + 1, 0.5 * (watch.size() + watch.colour())});
    if (watch.quiet()) quiet_until = k + 1;
    if (began == 0 && watch.on()) began = quiet_until;
  }
  if (began > 0) {
    stretch.begin = began;
  } else if (const std::size_t at = where_it_grows(blocks); at > 0) {
    stretch.begin = blocks[at - 1].end;
  }
  // What came before the alarm may be too little to tell: then the minutes behind it are waited for.
  stretch.end = std::min(record.size(), std::max(stretch.end, stretch.begin + samples(kEnough_s)));
  return stretch;
}

Explanation explain(const gap::Record& record, const plant::LoopModel& twin, std::size_t alarm,
                    const gap::ParallelFor& parallel) {
  Explanation out;
  out.stretch = telling_stretch(record, twin, alarm);
  const auto part = [&](const std::vector<double>& column) {
    return column.empty() ? column
                          : std::vector<double>(
                                column.begin() + static_cast<std::ptrdiff_t>(out.stretch.begin),
                                column.begin() + static_cast<std::ptrdiff_t>(out.stretch.end));
  };
  const gap::Record newest{record.period_s, part(record.pv), part(record.sp), part(record.co)};
  out.result = gap::find_gap(newest, twin, {}, parallel, [](double) {});
  out.closed = gap::gap_closed(out.result.before.holdout_rmse, out.result.after.holdout_rmse,
                               out.result.floor.rmse());
  return out;
}

bool agrees(const Explanation& e, AlarmKind alarm) {
  return std::any_of(e.result.effects.begin(), e.result.effects.end(), [&](const auto& effect) {
    const effects::Descriptor* info = effects::find_word(effect.spec.name);
    if (effect.spec.name == "learned" && effect.block == plant::Block::valve &&
        alarm == AlarmKind::unknown) {
      return true;
    }
    return alarm == AlarmKind::model_gap ||
           (info != nullptr && effects::agrees(*info, monitor::to_text(alarm)));
  });
}

std::optional<AlarmKind> final_name(const Explanation& e, AlarmKind alarm) {
  const gap::FoundEffect* effect = sure_effect(e);
  if (effect == nullptr || agrees(e, alarm)) return std::nullopt;
  if (effect->block != plant::Block::valve) return AlarmKind::model_gap;
  const effects::Descriptor* info = effects::find_word(effect->spec.name);
  for (const AlarmKind kind : monitor::kWindowAlarms) {
    if (info != nullptr && !info->alarms.empty() &&
        info->alarms.front() == monitor::to_text(kind)) {
      return kind;
    }
  }
  return AlarmKind::unknown;
}

double size_percent(const Explanation& e) {
  const gap::FoundEffect* effect = sure_effect(e);
  if (effect == nullptr) return 0.0;
  const control::PidSettings& pid = e.result.model.controller.pid;
  const double size = size_percent(effect->spec, pid.output_span());
  return std::isfinite(size) ? size : 0.0;
}

}  // namespace loopwarden::commission
