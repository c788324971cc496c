// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "base/clock.hpp"
#include "daemon/protocol/ask.hpp"
#include "services/page/api/body.hpp"
#include "services/page/api/handlers.hpp"
#include "services/page/api/tags.hpp"
#include "services/page/history/trend_rows.hpp"

namespace loopwarden::page::api {
namespace {

using nlohmann::json;

constexpr std::int64_t kTenMinutes_ms = 600'000;
constexpr std::size_t kMostCsvRows = 1'000'000;

history::Stretch stretch_of(const http::Request& request) {
  const std::int64_t to_ms = whole_in(request, "to_ms", 0, kLastMoment_ms).value_or(base::utc_ms());
  const std::int64_t from_ms =
      whole_in(request, "from_ms", 0, kLastMoment_ms).value_or(to_ms - kTenMinutes_ms);
  if (from_ms >= to_ms) throw ApiError(400, "from_ms must be before to_ms", "from_ms");
  return {from_ms, to_ms};
}

// Returns the rows in the daemon's memory that the segments lack, because the loop is not recorded
// or the disk is late.
std::vector<history::Block> newer_rows(Context& context, const Box::Now& now, const BoxState& state,
                                       const protocol::LoopDescription& loop,
                                       const std::optional<history::Block>& newest) {
  constexpr std::int64_t kUsualLag_ms = 2000;
  if (!now.up || !now.periods) return {};
  if (newest && now.now_ms - newest->last_ms < kUsualLag_ms) return {};
  const double period_now = now.periods->at(state.index.at(loop.tag));
  const double ms_per_period = 1000.0 * loop.sample_time_s / state.about.accelerate;
  if (!std::isfinite(period_now)) return {};
  const auto trend = ask(context.daemon, protocol::TrendRequest{.loop = loop.tag});
  return history::rows_of(trend, {period_now, now.now_ms, ms_per_period}, newest);
}

void append_number(std::string& text, float value) {
  if (std::isfinite(value)) {
    fmt::format_to(std::back_inserter(text), "{:.7g},", value);
  } else {
    text += "null,";
  }
}

template <class Values, class Append>
void append_list(std::string& text, const char* name, const Values& values, Append append) {
  fmt::format_to(std::back_inserter(text), ",\"{}\":[", name);
  for (const auto value : values) append(text, value);
  if (text.back() == ',') text.pop_back();
  text += ']';
}

json or_null(const std::optional<std::int64_t>& value) { return value ? json(*value) : json(); }

// Written without a JSON library, which takes ten times as long for the four thousand rows.
std::string past_json(const history::Past& past, const history::Stretch& stretch,
                      const protocol::LoopDescription& loop) {
  const json head = {
      {"from_ms", stretch.from_ms},
      {"to_ms", stretch.to_ms},
      {"oldest_ms", or_null(past.oldest_ms)},
      {"newest_ms", or_null(past.newest_ms)},
      {"sample_time_s", loop.sample_time_s},
      {"bucket_s", past.bucket_ms ? json(std::round(*past.bucket_ms) / 1000.0) : json()},
      {"unreadable", past.unreadable}};
  std::string text = dump(head);
  text.pop_back();
  append_list(text, "t", past.curves.t_ms, [](std::string& to, std::int64_t t) {
    fmt::format_to(std::back_inserter(to), "{},", t);
  });
  constexpr std::array<const char*, history::kColumns> kNames{"pv", "sp", "co", "stem"};
  for (std::size_t i = 0; i < history::kColumns; ++i) {
    if (i == history::kStem && !loop.stem) continue;
    append_list(text, kNames[i], past.curves.columns[i], append_number);
  }
  append_list(text, "mode", past.curves.mode, [](std::string& to, std::int16_t mode) {
    mode < 0 ? to += "null," : to += fmt::format("{},", mode);
  });
  append_list(text, "sample", past.curves.sample,
              [](std::string& to, std::uint8_t sample) { to += sample != 0 ? "1," : "0,"; });
  return text + "}";
}

// Writes rows as CSV. Time counts periods from the first row, so the file is a record for
// `loopwarden gap` and `diagnose`. Missing rows are left out; missing values are empty cells.
class RowsAsCsv final : public http::Source {
 public:
  RowsAsCsv(const std::filesystem::path& folder, const history::Stretch& stretch, bool stem)
      : reader_(folder, stretch), stem_(stem) {}

  std::string next() override {
    std::string text;
    if (!begun_) text = stem_ ? "time,pv,sp,co,stem,mode,utc_ms\n" : "time,pv,sp,co,mode,utc_ms\n";
    begun_ = true;
    if (rows_ >= kMostCsvRows) return text;
    for (const history::RowReader::Row& row : reader_.next()) {
      if (rows_++ >= kMostCsvRows) break;
      append(text, row);
    }
    return text;
  }

 private:
  void append(std::string& text, const history::RowReader::Row& row) {
    if (!first_ || first_->run != row.run) {
      // Each run of the daemon counts its own periods. After a restart the file's time follows the
      // clock, in whole periods.
      offset_ = first_ ? std::max(1.0, std::round(static_cast<double>(row.utc_ms - last_ms_) /
                                                  1000.0 / row.period_s)) +
                             last_period_
                       : 0.0;
      first_ = row;
    }
    last_period_ = offset_ + static_cast<double>(row.row.period_index - first_->row.period_index);
    last_ms_ = row.utc_ms;
    fmt::format_to(std::back_inserter(text), "{:.10g},", last_period_ * row.period_s);
    for (const double value : {row.row.pv, row.row.sp, row.row.co}) append_cell(text, value);
    if (stem_) append_cell(text, row.row.stem);
    fmt::format_to(std::back_inserter(text), "{},{}\n", static_cast<int>(row.row.mode), row.utc_ms);
  }

  static void append_cell(std::string& text, double value) {
    if (std::isfinite(value)) fmt::format_to(std::back_inserter(text), "{:.9g}", value);
    text += ',';
  }

  history::RowReader reader_;
  bool stem_;
  bool begun_ = false;
  std::size_t rows_ = 0;
  std::optional<history::RowReader::Row> first_;  // of this run
  double offset_ = 0.0;                           // periods
  double last_period_ = 0.0;
  std::int64_t last_ms_ = 0;
};

}  // namespace

std::filesystem::path segments_of(const Context& context, const protocol::LoopDescription& loop) {
  return context.settings.state_directory / "segments" / loop.tag;
}

http::Response past(Context& context, const Call& call) {
  check_query(call.request, {"from_ms", "to_ms", "points"});
  const Box::Now now = context.now();
  const protocol::LoopDescription& loop = loop_at(now.state, call.request.part(2));
  const history::Stretch stretch = stretch_of(call.request);
  const auto points =
      static_cast<std::size_t>(whole_in(call.request, "points", history::kRowsPerBucket,
                                        static_cast<std::int64_t>(history::kMostPoints))
                                   .value_or(1000));
  const history::Past past =
      context.history.past(segments_of(context, loop), stretch, points,
                           [&](const std::optional<history::Block>& newest) {
                             return newer_rows(context, now, *now.state, loop, newest);
                           });
  http::Response response;
  response.body = past_json(past, stretch, loop);
  return response;
}

http::Response past_csv(Context& context, const Call& call) {
  check_query(call.request, {"from_ms", "to_ms"});
  const auto state = context.now().state;
  const protocol::LoopDescription& loop = loop_at(state, call.request.part(2));
  const history::Stretch stretch = stretch_of(call.request);
  http::Response response;
  response.content_type = "text/csv; charset=utf-8";
  response.headers.emplace_back(
      "Content-Disposition",
      fmt::format("attachment; filename=\"{}_{}.csv\"", loop.tag, stretch.from_ms));
  response.source = std::make_unique<RowsAsCsv>(segments_of(context, loop), stretch, loop.stem);
  return response;
}

}  // namespace loopwarden::page::api
