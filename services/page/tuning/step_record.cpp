// SPDX-License-Identifier: Apache-2.0
#include "services/page/tuning/step_record.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace loopwarden::page::tuning {
namespace {

constexpr double kStepShare = 0.01;  // of PV's range
constexpr double kTimesBefore = 5.0;
constexpr double kTimesAfter = 20.0;
constexpr double kFewestSamples = 300.0;
constexpr double kLongest_s = 4.0 * 86'400.0;
constexpr double kMostRows = 2e6;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

constexpr auto kAutomatic = static_cast<std::int16_t>(control::Mode::automatic);

// Returns the rows between which the set point reached its final value.
std::optional<history::Stretch> last_move(const history::Curves& curves, double least) {
  const std::vector<float>& sp = curves.columns[history::kSp];
  std::optional<std::size_t> later;
  for (std::size_t i = sp.size(); i-- > 0;) {
    if (!std::isfinite(sp[i]) || curves.mode[i] != kAutomatic) {
      // Moves in manual mode, or while the loop was not recorded, are not steps.
      later.reset();
      continue;
    }
    if (later && std::abs(static_cast<double>(sp[i]) - static_cast<double>(sp[*later])) >= least) {
      return history::Stretch{curves.t_ms[i], curves.t_ms[i + 1]};
    }
    if (!later) later = i;
  }
  return std::nullopt;
}

// Averages `every` consecutive rows by their periods. Missing rows stay missing.
class Thinner {
 public:
  Thinner(StepRecord& record, std::uint64_t every) : record_(record), every_(every) {}

  void add(const record::RecordRow& row) {
    if (!first_) first_ = row.period_index;
    const std::uint64_t place = (row.period_index - *first_) / every_;
    while (place_ < place) flush();
    sp_.add(row.sp);
    pv_.add(row.pv);
    co_.add(row.co);
    mode_.add(row.mode == control::Mode::automatic ? 1.0 : 0.0);
  }
  void flush() {
    record_.sp.push_back(sp_.take());
    record_.pv.push_back(pv_.take());
    record_.co.push_back(co_.take());
    record_.automatic.push_back(std::round(mode_.take()));
    ++place_;
  }

 private:
  struct Mean {
    double sum = 0.0;
    double count = 0.0;
    void add(double value) {
      if (!std::isfinite(value)) return;
      sum += value;
      count += 1.0;
    }
    double take() {
      const double mean = count > 0.0 ? sum / count : kNone;
      sum = count = 0.0;
      return mean;
    }
  };
  StepRecord& record_;
  std::uint64_t every_;
  std::optional<std::uint64_t> first_;
  std::uint64_t place_ = 0;
  Mean sp_, pv_, co_, mode_;
};

}  // namespace

std::optional<StepRecord> newest_step(history::History& history,
                                      const std::filesystem::path& folder, const StepWish& wish) {
  const auto nothing_newer = [](const std::optional<history::Block>&) {
    return std::vector<history::Block>{};
  };
  // Searches from coarse to fine: buckets show the region of the step, until they are single rows.
  std::optional<history::Stretch> move;
  history::Stretch look{0, wish.now_ms};
  {
    const history::Past all = history.past(folder, look, history::kRowsPerBucket, nothing_newer);
    look.from_ms = all.oldest_ms.value_or(wish.now_ms);
  }
  for (;;) {
    const history::Past past = history.past(folder, look, history::kMostPoints, nothing_newer);
    const auto found = last_move(past.curves, kStepShare * wish.pv_span);
    if (!found) break;
    const bool finer =
        past.bucket_ms.has_value() && found->to_ms - found->from_ms < look.to_ms - look.from_ms;
    move = found;
    if (!finer) break;
    // Includes the neighbouring buckets: extremes are placed at a third and two thirds of a bucket.
    const auto margin_ms = static_cast<std::int64_t>(*past.bucket_ms);
    look = {found->from_ms - margin_ms, found->to_ms + margin_ms};
  }
  if (!move) return std::nullopt;

  const double h = wish.sample_time_s;
  const double most_s = std::min(kLongest_s, kMostRows * h);
  const double total_s = std::clamp((kTimesBefore + kTimesAfter) * wish.integral_time_s,
                                    std::min(kFewestSamples * h, most_s), most_s);
  const double before_s = total_s * kTimesBefore / (kTimesBefore + kTimesAfter);
  StepRecord record;
  record.step_ms = move->to_ms;
  record.from_ms = move->from_ms - std::llround(before_s * wish.ms_per_s);
  const std::int64_t after_ms = std::llround((total_s - before_s) * wish.ms_per_s);
  record.to_ms = std::min(wish.now_ms, record.step_ms + after_ms);
  const double rows = static_cast<double>(record.to_ms - record.from_ms) / wish.ms_per_s / h;
  const auto every = static_cast<std::uint64_t>(
      std::max(1.0, std::ceil(rows / static_cast<double>(kMostSamples))));
  record.period_s = h * static_cast<double>(every);
  std::optional<Thinner> thinner;
  history::RowReader reader(folder, {record.from_ms, record.to_ms});
  std::optional<std::uint64_t> run;
  for (auto piece = reader.next(); !piece.empty(); piece = reader.next()) {
    for (const history::RowReader::Row& row : piece) {
      // Each run of the daemon counts its own periods. Only the run with the step is used.
      if (run && row.run != *run) {
        if (row.utc_ms > record.step_ms) {
          record.to_ms = row.utc_ms;
          break;
        }
        record.sp.clear();
        record.pv.clear();
        record.co.clear();
        record.automatic.clear();
        record.from_ms = row.utc_ms;
        thinner.reset();
      }
      if (!thinner) thinner.emplace(record, every);
      run = row.run;
      thinner->add(row.row);
    }
    if (piece.back().run != *run) break;
  }
  if (thinner) thinner->flush();
  return record;
}

}  // namespace loopwarden::page::tuning
