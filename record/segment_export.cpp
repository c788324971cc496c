// SPDX-License-Identifier: Apache-2.0
#include "record/segment_export.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <ctime>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

#include "record/record_csv.hpp"
#include "record/segment_reader.hpp"

namespace loopwarden::record {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string>& further_columns() {
  static const std::vector<std::string> names{
      "calculated", "jacket",      "jacket_shadow",      "mode",    "requested_mode",
      "fault",      "pv_quality",  "pv_reason",          "flags",   "jacket_form",
      "age_ms",     "compensator", "compensator_shadow", "pv_limit"};
  return names;
}

// Returns the double with the same short decimal text as the float.
double widened(float value) {
  if (!std::isfinite(value)) return RecordSample::kNone;
  std::array<char, 32> digits;
  const char* end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  double wide = 0.0;
  std::from_chars(digits.data(), end, wide);
  return wide;
}

std::string utc_text(std::int64_t utc_ns) {
  const std::time_t seconds = static_cast<std::time_t>(utc_ns / 1'000'000'000);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  return fmt::format("{:04}{:02}{:02}T{:02}{:02}{:02}Z", utc.tm_year + 1900, utc.tm_mon + 1,
                     utc.tm_mday, utc.tm_hour, utc.tm_min, utc.tm_sec);
}

// Returns whether a segment was last written an hour or more before a moment. A change of the clock
// by less than an hour loses no rows.
bool ended_before(const fs::path& file, std::int64_t utc_ns) {
  struct stat found {};
  constexpr std::int64_t kHour_s = 3600;
  return ::stat(file.c_str(), &found) == 0 && found.st_mtime + kHour_s < utc_ns / 1'000'000'000;
}

class Exporter {
 public:
  Exporter(fs::path target, const ExportSettings& settings, ExportResult& result)
      : target_(std::move(target)), settings_(settings), result_(result) {}

  void add(const Segment& segment) {
    for (const RecordRow& row : segment.rows) {
      const std::int64_t utc = utc_ns(segment.header, row);
      if (settings_.from_utc_ns && utc < *settings_.from_utc_ns) continue;
      if (settings_.to_utc_ns && utc >= *settings_.to_utc_ns) continue;
      if (!continues(segment.header, row)) begin(segment.header, row, utc);
      fill_up_to(row.period_index);
      write(row);
    }
  }

  void end() {
    if (!writer_) return;
    if (writer_->rows() < 2) {
      ++result_.single_rows;
      const fs::path temporary = writer_->temporary_path();
      writer_.reset();
      std::error_code ignored;
      fs::remove(temporary, ignored);
      return;
    }
    writer_->finish();
    current_.rows = writer_->rows();
    result_.records.push_back(current_);
    writer_.reset();
  }

 private:
  bool continues(const SegmentHeader& header, const RecordRow& row) const {
    return writer_ && header.run == run_ && header.period_s == period_s_ &&
           row.period_index > last_period_ &&
           row.period_index - last_period_ - 1 <= settings_.longest_filled_gap;
  }

  void begin(const SegmentHeader& header, const RecordRow& row, std::int64_t utc) {
    end();
    run_ = header.run;
    period_s_ = header.period_s;
    first_period_ = row.period_index;
    last_period_ = row.period_index - 1;
    current_ = {
        .path = free_path(header.loop, utc), .start_utc_ns = utc, .rows = 0, .filled_rows = 0};
    writer_ = std::make_unique<RecordCsvWriter>(
        settings_.place ? settings_.place(current_.path) : current_.path,
        RecordColumns{.more = further_columns()});
  }

  // Files that begin in the same second get a number.
  fs::path free_path(std::string loop, std::int64_t utc) const {
    for (char& c : loop) {
      const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_';
      if (!plain) c = '_';
    }
    const std::string stem = loop + "_" + utc_text(utc);
    fs::path path = target_ / (stem + ".csv");
    const auto taken = [&] {
      return std::any_of(result_.records.begin(), result_.records.end(),
                         [&](const ExportedRecord& record) { return record.path == path; });
    };
    for (int n = 2; taken(); ++n) path = target_ / fmt::format("{}_{}.csv", stem, n);
    return path;
  }

  double time_of(std::uint64_t period) const {
    return static_cast<double>(period - first_period_) * period_s_;
  }

  void fill_up_to(std::uint64_t period) {
    for (std::uint64_t missing = last_period_ + 1; missing != period; ++missing) {
      writer_->add({.time_s = time_of(missing)});
      ++current_.filled_rows;
    }
    last_period_ = period;
  }

  void write(const RecordRow& row) {
    const std::array<double, 14> more{widened(row.calculated),
                                      widened(row.jacket_rate),
                                      widened(row.jacket_rate_shadow),
                                      static_cast<double>(row.mode),
                                      static_cast<double>(row.requested_mode),
                                      static_cast<double>(row.fault),
                                      static_cast<double>(row.pv_quality),
                                      static_cast<double>(row.pv_reason),
                                      static_cast<double>(row.flags),
                                      static_cast<double>(row.jacket_form),
                                      widened(row.age_ms),
                                      widened(row.compensator),
                                      widened(row.compensator_shadow),
                                      static_cast<double>(row.pv_limit)};
    writer_->add({.time_s = time_of(row.period_index),
                  .pv = row.pv,
                  .sp = row.sp,
                  .co = row.co,
                  .stem = row.stem},
                 more);
  }

  fs::path target_;
  const ExportSettings& settings_;
  ExportResult& result_;
  std::unique_ptr<RecordCsvWriter> writer_;
  ExportedRecord current_;
  std::uint64_t run_ = 0;
  double period_s_ = 0.0;
  std::uint64_t first_period_ = 0;
  std::uint64_t last_period_ = 0;
};

}  // namespace

ExportResult export_csv(const fs::path& folder, const fs::path& target,
                        const ExportSettings& settings) {
  std::error_code error;
  if (!settings.place) fs::create_directories(target, error);
  if (error) {
    throw RecordError(RecordError::Kind::io, 0, 0,
                      target.string() + ": can't be created: " + error.message());
  }
  ExportResult result;
  Exporter exporter(target, settings, result);
  for (const SegmentFile& file : list_segments(folder)) {
    if (settings.from_utc_ns && ended_before(file.path, *settings.from_utc_ns)) continue;
    std::optional<Segment> segment;
    try {
      segment = read_segment(file.path);
    } catch (const RecordError& problem) {
      result.unreadable.emplace_back(problem.what());
      continue;
    }
    result.damaged_rows += segment->damaged_rows;
    result.torn_bytes += segment->torn_bytes;
    exporter.add(*segment);
  }
  exporter.end();
  return result;
}

}  // namespace loopwarden::record
