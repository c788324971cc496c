// SPDX-License-Identifier: Apache-2.0
#include "record/import/file_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "base/text.hpp"
#include "record/import/number_text.hpp"

namespace loopwarden::record {
namespace {

class FileReader {
 public:
  FileReader(TextSource& source, const Layout& layout, const ImportOptions& options)
      : source_(source), layout_(layout), options_(options) {}

  std::optional<TimePoint> origin() const { return origin_; }
  std::size_t shifted_hours() const { return shifted_hours_; }

  // Wide: column -> target.
  void read_wide(const std::vector<std::pair<std::size_t, SignalTarget>>& columns,
                 const ImportProgress& progress) {
    times_ = std::make_shared<std::vector<double>>();
    const std::size_t rows = expected_rows();
    times_->reserve(rows);
    for (const auto& [column, target] : columns) {
      target.signal->time_s = times_;
      target.signal->value.reserve(rows);
    }
    if (!skip_header()) return;
    while (next_row(progress)) {
      double time_s = 0.0;
      if (!row_time(time_s)) continue;
      if (cells_.cells.size() > layout_.names.size() && !trimmed_to_columns()) {
        fail_too_wide();
      }
      // A file that was copied while it was written.
      if (cells_.cells.size() < layout_.names.size() && at_last_line()) break;
      times_->push_back(time_s);
      for (const auto& [column, target] : columns) {
        target.signal->value.push_back(
            value_or_error(cell(column), target, quality_at(layout_.quality_of[column])));
      }
    }
    turn_if_backwards(columns);
    settle_words();
  }

  // Pairs: column -> target, its times in the column before it. They are of different lengths.
  void read_pairs(const std::vector<std::pair<std::size_t, SignalTarget>>& columns,
                  const ImportProgress& progress) {
    for (const auto& [column, target] : columns)
      target.signal->time_s = std::make_shared<std::vector<double>>();
    std::vector<Clock> clocks(columns.size());
    if (!skip_header()) return;
    while (next_row(progress)) {
      if (cells_.cells.size() > layout_.names.size() && !trimmed_to_columns()) fail_too_wide();
      const bool cut = cells_.cells.size() < layout_.names.size() && at_last_line();
      for (std::size_t k = 0; k < columns.size(); ++k) {
        const auto& [column, target] = columns[k];
        const std::string_view time = cell(column - 1);
        // "No events found" stands where a tag has no more values.
        if (time.empty() || (cut && column + 1 >= cells_.cells.size())) continue;
        double time_s = 0.0;
        if (!read_time(time, clocks[k], time_s)) {
          if (cell(column).empty()) continue;
          fail_time(time);
        }
        const double value = value_or_error(cell(column), target, SampleQuality::good);
        target.signal->time_s->push_back(time_s);
        target.signal->value.push_back(std::isnan(value) && target.role != Role::mode ? kBad
                                                                                      : value);
      }
    }
    for (const auto& [column, target] : columns) sort_by_time(*target.signal);
    settle_words();
  }

  // Long: tag -> target.
  void read_long(const std::unordered_map<std::string, SignalTarget>& tags,
                 const ImportProgress& progress) {
    for (const auto& [tag, target] : tags)
      target.signal->time_s = std::make_shared<std::vector<double>>();
    if (!skip_header()) return;
    std::string last_name;
    const SignalTarget* last = nullptr;
    std::string key;
    std::string buffer;
    while (next_row(progress)) {
      if (is_annotation(layout_, cells_)) {
        if (!take_annotation(layout_, cells_))
          fail_at(line_, "a table without _time, _field and _value begins here");
        continue;
      }
      const std::size_t needed = std::max({layout_.time, layout_.tag, layout_.value});
      if (cells_.cells.size() <= needed) {
        if (footer() || at_last_line()) continue;
        fail_at(line_.substr(line_.size()), fmt::format("{} cells where a row has {}",
                                                        cells_.cells.size(), layout_.names.size()));
      }
      if (cells_.cells.size() > layout_.names.size() && !trimmed_to_columns()) fail_too_wide();
      const std::string_view name = tag_of(layout_, cells_, buffer);
      if (last == nullptr || name != last_name) {
        last_name = name;
        key = name;
        const auto at = tags.find(key);
        last = at == tags.end() ? nullptr : &at->second;
      }
      if (last == nullptr) continue;
      double time_s = 0.0;
      if (!row_time(time_s)) continue;
      const double value =
          value_or_error(cells_.cells[layout_.value], *last, quality_at(layout_.quality));
      last->signal->time_s->push_back(time_s);
      // Every row says something: one without a value says that there was none.
      last->signal->value.push_back(std::isnan(value) && last->role != Role::mode ? kBad : value);
    }
    for (const auto& [tag, target] : tags) sort_by_time(*target.signal);
    settle_words();
  }

 private:
  // Where they stand among numbers they are bad values; where not, the signal may be anything.
  struct Words {
    std::map<std::string, std::size_t> cells;
    std::size_t all = 0;
    RecordError first;
    SignalTarget target;
  };

  // Of the row; empty where it has no such column.
  std::string_view cell(std::size_t column) const {
    return column < cells_.cells.size() ? cells_.cells[column] : std::string_view();
  }

  [[noreturn]] void fail_at(std::string_view cell, const std::string& what) const {
    throw error_at(cell, what);
  }

  RecordError error_at(std::string_view cell, const std::string& what) const {
    const char* begin = line_.data();
    const bool within = cell.data() >= begin && cell.data() <= begin + line_.size();
    const std::size_t column =
        within ? place_in_line(line_, static_cast<std::size_t>(cell.data() - begin), options_) : 1;
    return RecordError(
        RecordError::Kind::data, source_.line_number(), column,
        fmt::format("{}:{}:{}: {}", source_.name(), source_.line_number(), column, what));
  }

  [[noreturn]] void fail_too_wide() const {
    fail_at(cells_.cells[layout_.names.size()], too_wide_text(cells_.cells.size(), layout_));
  }

  std::size_t expected_rows() {
    const std::string_view head = source_.peek(kHeadLines);
    const std::size_t lines = static_cast<std::size_t>(std::count(head.begin(), head.end(), '\n'));
    if (lines < 3 || source_.text_bytes() == 0) return 0;
    const double encoded = source_.encoding() == Encoding::utf16 ? 2.0 : 1.0;
    const double row_bytes =
        encoded * static_cast<double>(head.size()) / static_cast<double>(lines);
    return static_cast<std::size_t>(1.03 * static_cast<double>(source_.text_bytes()) / row_bytes) +
           16;
  }

  bool skip_header() {
    for (std::size_t k = 0; k < layout_.header_rows; ++k) {
      if (!source_.next(line_)) return false;
      if (layout_.annotated && cells_.split(line_, layout_.delimiter) &&
          is_annotation(layout_, cells_))
        take_annotation(layout_, cells_);
    }
    return true;
  }

  bool next_row(const ImportProgress& progress) {
    while (source_.next(line_)) {
      if (source_.line_number() % kProgressRows == 0) progress(source_.share_read());
      std::size_t open = 0;
      if (!cells_.split(line_, layout_.delimiter, &open)) {
        if (at_last_line()) return false;
        fail_at(line_.substr(open), "no closing quote in this line");
      }
      if (cells_.cells.size() > 1 || !cells_.cells.front().empty()) return true;
    }
    return false;
  }

  bool at_last_line() const { return source_.at_end(); }

  // Cells behind the last column are empty: a delimiter at the end of the line.
  bool trimmed_to_columns() {
    while (cells_.cells.size() > layout_.names.size() && cells_.cells.back().empty())
      cells_.cells.pop_back();
    return cells_.cells.size() <= layout_.names.size();
  }

  // "(3600 rows affected)", "End of report": at most two words, no time.
  bool footer() const {
    const auto filled = std::count_if(cells_.cells.begin(), cells_.cells.end(),
                                      [](std::string_view c) { return !c.empty(); });
    return filled <= 2 && !(filled == 2 && layout_.names.size() == 2);
  }

  // What is known of a column of local times.
  struct Clock {
    std::optional<double> last_s;
    bool rising = true;
    std::size_t shifted_hours = 0;
  };

  bool row_time(double& time_s) {
    const std::string_view text = cell(layout_.time);
    if (read_time(text, clock_, time_s)) return true;
    if (footer() || at_last_line()) return false;
    fail_time(text);
  }

  [[noreturn]] void fail_time(std::string_view text) const {
    if (text.empty()) fail_at(text, "no time");
    std::string help;
    if (layout_.form == TimeForm::dmy || layout_.form == TimeForm::mdy) {
      const DateOrder order = possible_orders(text);
      if (order.dmy != order.mdy) {
        help = fmt::format("; it is {}: --time {}", order.dmy ? "day-month-year" : "month-day-year",
                           order.dmy ? "dmy" : "mdy");
      }
    }
    fail_at(text, fmt::format("{} is no time of the form {}{}", base::in_quotes(text),
                              to_text(layout_.form), help));
  }

  // False where it is none.
  bool read_time(std::string_view text, Clock& local, double& time_s) {
    if (layout_.form == TimeForm::seconds) {
      const std::optional<double> number = parse_number(text, layout_.decimal);
      if (number) time_s = *number;
      return number.has_value();
    }
    std::optional<TimePoint> point = parse_time(text, layout_.form, layout_.decimal);
    if (!point) return false;
    if (layout_.clock != kNoColumn) {
      const std::string_view clock = cell(layout_.clock);
      const auto of_day = parse_time(clock, TimeForm::clock);
      if (!of_day) fail_at(clock, fmt::format("{} is no time of day", base::in_quotes(clock)));
      point->whole_s += of_day->whole_s;
      point->rest_s += of_day->rest_s;
    }
    if (options_.zone_s && is_date(layout_.form) && !point->zone_known) {
      point->whole_s -= *options_.zone_s;
      point->zone_known = true;
    }
    if (!is_absolute(layout_.form)) {
      time_s = static_cast<double>(point->whole_s) + point->rest_s;
      return true;
    }
    if (!origin_) origin_ = point;
    time_s = point->since(*origin_);
    // Local times fall back by an hour once a year; without a zone nothing else tells.
    if (is_date(layout_.form) && !point->zone_known && !layout_.is_long) {
      const double shifted = time_s + 3600.0 * static_cast<double>(local.shifted_hours);
      if (local.last_s && shifted < *local.last_s - 1800.0 && shifted > *local.last_s - 3660.0 &&
          local.rising) {
        ++local.shifted_hours;
        shifted_hours_ = std::max(shifted_hours_, local.shifted_hours);
      }
      time_s += 3600.0 * static_cast<double>(local.shifted_hours);
      local.rising = !local.last_s || time_s > *local.last_s;
      local.last_s = time_s;
    }
    return true;
  }

  SampleQuality quality_at(std::size_t column) const {
    if (column == kNoColumn || column >= cells_.cells.size()) return SampleQuality::good;
    return parse_quality(cells_.cells[column], layout_.zero_is_good);
  }

  double value_or_error(std::string_view text, const SignalTarget& target, SampleQuality quality) {
    if (*target.error) return kEmpty;
    try {
      return value_of(text, target, quality);
    } catch (const RecordError& e) {
      *target.error = e;
      return kEmpty;
    }
  }

  double value_of(std::string_view text, const SignalTarget& target, SampleQuality quality) {
    if (target.role == Role::mode)
      return target.mode_words != nullptr ? target.mode_words->read(text) : parse_mode(text);
    const CellValue cell = parse_value(text, layout_.decimal, options_.bad_words);
    if (cell.cell == Cell::number) {
      if (quality == SampleQuality::good) return cell.value;
      ++(quality == SampleQuality::bad ? target.signal->bad : target.signal->questionable);
      return kBad;
    }
    switch (cell.cell) {
      case Cell::empty: return kEmpty;
      case Cell::bad: ++target.signal->bad; return kBad;
      case Cell::questionable: ++target.signal->questionable; return kBad;
      default: break;
    }
    if (count_word(text, target)) return kBad;
    throw not_a_number(text);
  }

  RecordError not_a_number(std::string_view text) const {
    return error_at(
        text, fmt::format("{} is not a number; where it stands for a bad value: --bad-value {}",
                          base::in_quotes(text), base::in_quotes(text)));
  }

  // False where it is no word, or one of too many.
  bool count_word(std::string_view text, const SignalTarget& target) {
    constexpr std::size_t kMostWords = 20;
    constexpr std::string_view kOfNumbers = "0123456789+-.,";
    const auto of_word = [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
             static_cast<unsigned char>(c) >= 0x80;
    };
    if (kOfNumbers.find(text.front()) != kOfNumbers.npos ||
        std::none_of(text.begin(), text.end(), of_word))
      return false;
    auto at = words_.find(target.signal);
    if (at == words_.end())
      at = words_.emplace(target.signal, Words{{}, 0, not_a_number(text), target}).first;
    Words& words = at->second;
    if (words.cells.size() == kMostWords && words.cells.count(std::string(text)) == 0) return false;
    ++words.cells[std::string(text)];
    ++words.all;
    return true;
  }

  void settle_words() {
    constexpr std::size_t kNumbersAWord = 9;
    for (auto& [signal, words] : words_) {
      if (*words.target.error) continue;
      const auto numbers = static_cast<std::size_t>(
          std::count_if(signal->value.begin(), signal->value.end(),
                        [](double value) { return std::isfinite(value); }));
      if (numbers < kNumbersAWord * words.all) {
        *words.target.error = words.first;
        continue;
      }
      signal->bad += words.all;
      signal->words = std::move(words.cells);
    }
  }

  // Newest first, as some write.
  void turn_if_backwards(const std::vector<std::pair<std::size_t, SignalTarget>>& columns) {
    std::vector<double>& t = *times_;
    std::size_t down = 0;
    std::size_t first_down = 0;
    for (std::size_t k = 1; k < t.size(); ++k) {
      if (t[k] >= t[k - 1]) continue;
      if (down++ == 0) first_down = k;
    }
    if (down == 0) return;
    if (2 * down > t.size()) {
      std::reverse(t.begin(), t.end());
      for (const auto& [column, target] : columns)
        std::reverse(target.signal->value.begin(), target.signal->value.end());
      for (std::size_t k = 1; k < t.size(); ++k) {
        if (t[k] < t[k - 1]) fail_order(t.size() - k, t[k - 1], t[k]);
      }
      return;
    }
    fail_order(first_down, t[first_down], t[first_down - 1]);
  }

  [[noreturn]] void fail_order(std::size_t row, double time_s, double before_s) const {
    const std::size_t line = layout_.header_rows + row + 1;
    throw RecordError(
        RecordError::Kind::data, line, 0,
        fmt::format("{}:{}: the time goes back by {:.6g} s; local times at the end of summer time? "
                    "Sort the rows, or export in UTC",
                    source_.name(), line, before_s - time_s));
  }

  static void sort_by_time(Signal& signal) {
    std::vector<double>& t = *signal.time_s;
    if (std::is_sorted(t.begin(), t.end())) return;
    std::vector<std::size_t> order(t.size());
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
    std::stable_sort(order.begin(), order.end(),
                     [&t](std::size_t a, std::size_t b) { return t[a] < t[b]; });
    std::vector<double> time(t.size());
    std::vector<double> value(t.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      time[k] = t[order[k]];
      value[k] = signal.value[order[k]];
    }
    t = std::move(time);
    signal.value = std::move(value);
  }

  TextSource& source_;
  Layout layout_;  // of the table that is read
  const ImportOptions& options_;
  std::string_view line_;
  LineCells cells_;
  std::shared_ptr<std::vector<double>> times_;
  std::unordered_map<Signal*, Words> words_;
  std::optional<TimePoint> origin_;
  Clock clock_;
  std::size_t shifted_hours_ = 0;
};

}  // namespace

void Feed::add(ImportPart& part, const LoopSignals& signals, const Layout& layout) {
  parts.push_back(&part);
  for (std::size_t role = 0; role < kRoles; ++role) {
    const std::string& name = signals.names[role];
    if (name.empty()) continue;
    const SignalTarget target{&part.signals[role], static_cast<Role>(role), &part.error,
                              signals.mode_words.get()};
    if (layout.is_long) {
      if (!tags.try_emplace(name, target).second) copies.emplace_back(target, name);
      continue;
    }
    const auto column = std::find(layout.names.begin(), layout.names.end(), name);
    if (column == layout.names.end()) continue;
    columns.emplace_back(static_cast<std::size_t>(column - layout.names.begin()), target);
  }
}

void Feed::copy() {
  for (const auto& [target, name] : copies) {
    const SignalTarget& from = tags.at(name);
    *target.signal = *from.signal;
    if (*from.error) *target.error = *from.error;
  }
}

void Feed::forget_empty() {
  for (ImportPart* part : parts) {
    for (Signal& s : part->signals) {
      if (s.value.empty()) s = {};
    }
  }
}

void read_into(Feed& feed, TextSource& text, const Layout& layout, const ImportOptions& options,
               const ImportProgress& progress) {
  FileReader reader(text, layout, options);
  if (layout.is_long) {
    reader.read_long(feed.tags, progress);
    feed.copy();
    feed.forget_empty();
  } else if (layout.pairs) {
    reader.read_pairs(feed.columns, progress);
    feed.forget_empty();
  } else {
    reader.read_wide(feed.columns, progress);
  }
  for (ImportPart* part : feed.parts) {
    part->origin = reader.origin();
    part->shifted_hours = reader.shifted_hours();
  }
}

}  // namespace loopwarden::record
