// SPDX-License-Identifier: Apache-2.0
#include "record/import/file_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>

#include "base/text.hpp"
#include "record/import/decimal_marks.hpp"
#include "record/import/number_text.hpp"
#include "record/import/quality.hpp"
#include "record/import/time_jumps.hpp"
#include "record/import/units.hpp"

namespace loopwarden::record {
namespace {

class FileReader {
 public:
  FileReader(TextSource& source, const Layout& layout, const ImportOptions& options)
      : source_(source), layout_(layout), options_(options) {}

  std::optional<TimePoint> origin() const { return origin_; }
  const std::set<std::string>& remarks() const { return remarks_; }
  std::size_t shifted_hours() const { return shifted_hours_; }

  // Reads a wide table. `columns`: column -> target.
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
    std::vector<std::pair<std::size_t, Watched*>> watched;
    for (const auto& [column, target] : columns)
      watched.emplace_back(column, &watch(target, layout_.qualities_of[column]));
    while (next_row(progress)) {
      double time_s = 0.0;
      if (!row_time(time_s)) continue;
      if (cells_.cells.size() > layout_.names.size() && !trimmed_to_columns()) {
        fail_too_wide();
      }
      // The file was copied while it was being written.
      if (cells_.cells.size() < layout_.names.size() && at_last_line()) break;
      times_->push_back(time_s);
      note_qualities();
      for (const auto& [column, signal] : watched) add_value(cell(column), *signal);
    }
    settle_columns();
    turn_if_backwards(columns);
    mind_jumps(columns);
  }

  // Reads pairs. `columns`: column -> target, with its times in the column before it. Their lengths
  // differ.
  void read_pairs(const std::vector<std::pair<std::size_t, SignalTarget>>& columns,
                  const ImportProgress& progress) {
    for (const auto& [column, target] : columns)
      target.signal->time_s = std::make_shared<std::vector<double>>();
    std::vector<Clock> clocks(columns.size());
    if (!skip_header()) return;
    std::vector<Watched*> watched;
    for (const auto& [column, target] : columns) watched.push_back(&watch(target, {}));
    while (next_row(progress)) {
      if (cells_.cells.size() > layout_.names.size() && !trimmed_to_columns()) fail_too_wide();
      const bool cut = cells_.cells.size() < layout_.names.size() && at_last_line();
      for (std::size_t k = 0; k < columns.size(); ++k) {
        const auto& [column, target] = columns[k];
        const std::string_view time = cell(column - 1);
        // "No events found" follows the last value of a tag.
        if (time.empty() || (cut && column + 1 >= cells_.cells.size())) continue;
        double time_s = 0.0;
        if (!read_time(time, clocks[k], time_s)) {
          if (cell(column).empty()) continue;
          fail_time(time);
        }
        target.signal->time_s->push_back(time_s);
        add_value(cell(column), *watched[k]);
        say_there_was_none(target);
      }
    }
    settle_columns();
    for (const auto& [column, target] : columns) put_in_order(target);
  }

  // Reads a long table. `tags`: tag -> target.
  void read_long(const std::unordered_map<std::string, SignalTarget>& tags,
                 const ImportProgress& progress) {
    for (const auto& [tag, target] : tags)
      target.signal->time_s = std::make_shared<std::vector<double>>();
    if (!skip_header()) return;
    const std::vector<std::size_t> qualities = layout_.value < layout_.qualities_of.size()
                                                   ? layout_.qualities_of[layout_.value]
                                                   : std::vector<std::size_t>();
    for (const auto& [tag, target] : tags) watch(target, qualities);
    std::string last_name;
    Watched* last = nullptr;
    const auto target_of = [&](const std::string& tag) -> Watched* {
      const auto at = tags.find(tag);
      return at == tags.end() ? nullptr : &watched_.at(at->second.signal);
    };
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
        fail_at(line_.substr(line_.size()),
                fmt::format("{} cells instead of {}", cells_.cells.size(), layout_.names.size()));
      }
      if (cells_.cells.size() > layout_.names.size() && !trimmed_to_columns()) fail_too_wide();
      const std::string_view name = tag_of(layout_, cells_, buffer);
      if (last == nullptr || name != last_name) {
        last_name = name;
        key = name;
        last = target_of(key);
      }
      if (last == nullptr) continue;
      double time_s = 0.0;
      if (!row_time(time_s)) continue;
      last->target.signal->time_s->push_back(time_s);
      note_qualities();
      add_value(cells_.cells[layout_.value], *last);
      say_there_was_none(last->target);
    }
    settle_columns();
    for (const auto& [tag, target] : tags) put_in_order(target);
  }

 private:
  // Unknown words of a signal. Among numbers they are bad values; without any number, the signal
  // may have another meaning.
  struct Words {
    std::map<std::string, std::size_t> cells;
    std::size_t all = 0;
    RecordError first;
    SignalTarget target;
  };

  // Returns a cell of the row; empty if the row is shorter.
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

  // Accepts empty cells after the last column, which result from a delimiter at the end of the
  // line.
  bool trimmed_to_columns() {
    while (cells_.cells.size() > layout_.names.size() && cells_.cells.back().empty())
      cells_.cells.pop_back();
    return cells_.cells.size() <= layout_.names.size();
  }

  // Returns whether the row is a footer such as "(3600 rows affected)" or "End of report": at most
  // two words, no time.
  bool footer() const {
    const auto filled = std::count_if(cells_.cells.begin(), cells_.cells.end(),
                                      [](std::string_view c) { return !c.empty(); });
    return filled <= 2 && !(filled == 2 && layout_.names.size() == 2);
  }

  // State of a column of local times.
  struct Clock {
    std::optional<double> last_s;
    double step_s = 0.0;  // newest forward step
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

  // Returns false if the text is no time.
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
    // Local times fall back by an hour once a year. Without a zone, this can only be detected from
    // the times.
    if (is_date(layout_.form) && !point->zone_known && !layout_.is_long) {
      const double shifted = time_s + 3600.0 * static_cast<double>(local.shifted_hours);
      // Only a step back by an hour less one period is the end of summer time. Other steps back are
      // a changed clock.
      const double off = local.last_s ? *local.last_s + local.step_s - shifted - 3600.0 : 3600.0;
      if (local.rising && std::abs(off) <= 60.0 + 2.0 * local.step_s && local.step_s < 1800.0) {
        ++local.shifted_hours;
        shifted_hours_ = std::max(shifted_hours_, local.shifted_hours);
      }
      time_s += 3600.0 * static_cast<double>(local.shifted_hours);
      local.rising = !local.last_s || time_s > *local.last_s;
      if (local.last_s && time_s > *local.last_s) local.step_s = time_s - *local.last_s;
      local.last_s = time_s;
    }
    return true;
  }

  // State of a signal while its cells are read.
  struct Watched {
    SignalTarget target;
    std::vector<std::size_t> qualities;                 // columns
    std::vector<std::vector<QualityCells::Id>> states;  // by column of qualities, then by value
    MarkEvidence marks;                                 // unless the decimal mark is known
    std::optional<RecordError> open_mark;               // set at the first cell with two readings
    bool has_plain = false;                             // a number without a unit, not zero
  };

  Watched& watch(const SignalTarget& target, const std::vector<std::size_t>& qualities) {
    Watched& watched = watched_[target.signal];
    watched.target = target;
    watched.qualities = qualities;
    watched.states.resize(qualities.size());
    for (const std::size_t column : qualities)
      quality_cells_.try_emplace(column, quality_kind_of(column));
    return watched;
  }

  QualityKind quality_kind_of(std::size_t column) const {
    const QualityKind kind = quality_kind(layout_.names[column]);
    if (kind != QualityKind::none) return kind;
    // The last word that is a kind of quality, as in "FIC101.PV Validity".
    const std::string_view name = layout_.names[column];
    for (std::size_t at = 0; at < name.size(); ++at) {
      if (std::string_view(" ._-/\\:|([").find(name[at]) == name.npos) continue;
      for (const std::string_view part : {name.substr(at + 1), name.substr(0, at)}) {
        if (const QualityKind of = quality_kind(part); of != QualityKind::none) return of;
      }
    }
    return QualityKind::state;
  }

  // Records the qualities of the row. Each column of qualities counts once, however many signals it
  // belongs to.
  void note_qualities() {
    for (auto& [column, cells] : quality_cells_) row_quality_[column] = cells.add(cell(column));
  }

  void add_value(std::string_view text, Watched& watched) {
    watched.target.signal->value.push_back(value_or_error(text, watched));
    for (std::size_t k = 0; k < watched.qualities.size(); ++k)
      watched.states[k].push_back(row_quality_[watched.qualities[k]]);
  }

  // Marks a missing value: in a table with one row per value, a row without a value.
  static void say_there_was_none(const SignalTarget& target) {
    double& value = target.signal->value.back();
    if (std::isnan(value) && target.role != Role::mode) value = kBad;
  }

  void settle_columns() {
    settle_words();
    settle_decimals();
    for (auto& [column, cells] : quality_cells_) {
      for (const std::string& said : cells.settle())
        remarks_.insert(fmt::format("column {}: {}", base::in_quotes(layout_.names[column]), said));
    }
    for (auto& [signal, watched] : watched_) settle_qualities(watched);
  }

  void settle_qualities(Watched& watched) const {
    Signal& signal = *watched.target.signal;
    std::size_t numbers = 0;
    std::size_t taken = 0;
    for (std::size_t k = 0; k < signal.value.size() && !watched.qualities.empty(); ++k) {
      if (!std::isfinite(signal.value[k])) continue;
      ++numbers;
      SampleQuality worst = SampleQuality::good;
      for (std::size_t q = 0; q < watched.qualities.size(); ++q)
        worst =
            std::max(worst, quality_cells_.at(watched.qualities[q]).quality(watched.states[q][k]));
      if (worst == SampleQuality::good) continue;
      ++taken;
      ++(worst == SampleQuality::bad ? signal.bad : signal.questionable);
      signal.value[k] = kBad;
    }
    if (numbers == 0 || taken < numbers || *watched.target.error) return;
    *watched.target.error = RecordError(
        RecordError::Kind::data, 1, 0,
        fmt::format("{}: no value of {} has a good quality in {}, where most cells have "
                    "{}. If these values are good, leave the column out of the export",
                    source_.name(), base::in_quotes(watched.target.name),
                    base::in_quotes(layout_.names[watched.qualities.front()]),
                    base::in_quotes(quality_cells_.at(watched.qualities.front()).most_frequent())));
  }

  // Checks the decimal mark against all cells, and asks the user if the cells allow both marks.
  void settle_decimals() {
    if (layout_.decimal_known || options_.decimal) return;
    std::set<char> by_jumps;
    if (layout_.decimal_by_jumps) by_jumps.insert(layout_.decimal);
    std::string output;  // signal whose cells all have three digits after the mark
    for (const auto& [signal, watched] : watched_) {
      if (watched.marks.decides()) return;
      if (const char mark = watched.marks.by_jumps(); mark != '\0') by_jumps.insert(mark);
      if (watched.target.role == Role::co && watched.marks.in_all_cells() == layout_.decimal)
        output = watched.target.name;
    }
    if (by_jumps == std::set<char>{layout_.decimal}) return;
    const auto open_in = [&](char mark) {
      return std::any_of(watched_.begin(), watched_.end(), [mark](const auto& one) {
        return one.second.marks.example().find(mark) != std::string::npos;
      });
    };
    // A comma as delimiter shows that the writer uses a decimal point.
    if (by_jumps.empty() && layout_.delimiter == ',' && layout_.decimal == '.' && !open_in(','))
      return;
    const bool settled = by_jumps.empty() && !output.empty();
    const bool alike = std::all_of(watched_.begin(), watched_.end(), [&](const auto& one) {
      return !one.second.marks.is_open() || one.second.marks.in_all_cells() == layout_.decimal;
    });
    if (settled && !alike) {
      remarks_.insert(
          fmt::format("{}: all values have three digits after the {}, taken as "
                      "decimals; --decimal {} if they are thousands",
                      output, layout_.decimal == ',' ? "comma" : "point",
                      layout_.decimal == ',' ? "point" : "comma"));
    }
    for (auto& [signal, watched] : watched_) {
      if (!settled && watched.marks.is_open() && !*watched.target.error)
        *watched.target.error = watched.open_mark;
    }
  }

  double value_or_error(std::string_view text, Watched& watched) {
    const SignalTarget& target = watched.target;
    if (*target.error) return kEmpty;
    try {
      return value_of(text, watched);
    } catch (const RecordError& e) {
      *target.error = e;
      return kEmpty;
    }
  }

  double value_of(std::string_view text, Watched& watched) {
    const SignalTarget& target = watched.target;
    if (target.role == Role::mode)
      return target.mode_words != nullptr ? target.mode_words->read(text) : parse_mode(text);
    const CellValue cell = parse_value(text, layout_.decimal, options_.bad_words);
    switch (cell.cell) {
      case Cell::number:
        mind_unit(text, cell, watched);
        if (!layout_.decimal_known) mind_marks(text, watched);
        return cell.value;
      case Cell::empty: return kEmpty;
      case Cell::bad: ++target.signal->bad; return kBad;
      case Cell::questionable: ++target.signal->questionable; return kBad;
      default: break;
    }
    if (count_word(text, target)) return kBad;
    throw not_a_number(text);
  }

  // Requires one unit in all cells of a signal: "950 mbar" and "1.2 bar" can't be compared as
  // numbers.
  void mind_unit(std::string_view text, const CellValue& cell, Watched& watched) const {
    std::string& unit = watched.target.signal->unit;
    if (cell.unit.empty()) {
      if (cell.value == 0.0) return;
      if (!unit.empty())
        throw error_at(text,
                       fmt::format("{} has no unit, and other cells have {}: export values of "
                                   "one unit",
                                   base::in_quotes(text), base::in_quotes(unit)));
      watched.has_plain = true;
      return;
    }
    if (unit == cell.unit) return;
    if (watched.has_plain)
      throw error_at(text,
                     fmt::format("{} is not a number: it has the unit {}, and other cells have "
                                 "none",
                                 base::in_quotes(text), base::in_quotes(cell.unit)));
    if (!unit.empty())
      throw error_at(
          text,
          fmt::format("{} is in {}, and other cells are in {}: export values of one "
                      "unit",
                      base::in_quotes(text), base::in_quotes(cell.unit), base::in_quotes(unit)));
    unit = cell.unit;
  }

  void mind_marks(std::string_view text, Watched& watched) const {
    watched.marks.add(split_cell(text).text);
    if (watched.marks.is_open() && !watched.open_mark)
      watched.open_mark =
          error_at(text, base::in_quotes(watched.target.name) + ": " + watched.marks.question());
  }

  RecordError not_a_number(std::string_view text) const {
    const char other = layout_.decimal == ',' ? '.' : ',';
    if (parse_number(split_cell(text).text, other)) {
      return error_at(
          text, fmt::format("{} has a decimal {}, and the file decimal {}s: --decimal {} reads it",
                            base::in_quotes(text), other == ',' ? "comma" : "point",
                            other == ',' ? "point" : "comma", other == ',' ? "comma" : "point"));
    }
    const std::size_t end = number_end(text);
    if (end > 0 && end < text.size() &&
        parse_number(base::trimmed(text.substr(0, end)), layout_.decimal))
      return error_at(text, fmt::format("{} is not a number: text follows it. Export numbers "
                                        "only; if it marks a bad value: --bad-value {}",
                                        base::in_quotes(text), base::in_quotes(text)));
    return error_at(text, fmt::format("{} is not a number; if it marks a bad value: --bad-value {}",
                                      base::in_quotes(text), base::in_quotes(text)));
  }

  // Returns false if the text is no word, or if there are too many different words.
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

  // Reverses tables whose newest row is first.
  void turn_if_backwards(const std::vector<std::pair<std::size_t, SignalTarget>>& columns) {
    std::vector<double>& t = *times_;
    std::size_t down = 0;
    for (std::size_t k = 1; k < t.size(); ++k) down += t[k] < t[k - 1] ? 1U : 0U;
    turned_ = 2 * down > t.size();
    if (!turned_) return;
    std::reverse(t.begin(), t.end());
    for (const auto& [column, target] : columns)
      std::reverse(target.signal->value.begin(), target.signal->value.end());
  }

  TimeContext time_context() const {
    TimeContext context;
    context.is_absolute = origin_.has_value();
    context.local = is_date(layout_.form) && !(origin_ && origin_->zone_known);
    if (origin_) context.epoch_s = static_cast<double>(origin_->whole_s) + origin_->rest_s;
    context.text = [origin = origin_](double time_s) {
      if (!origin) return fmt::format("{:.6g} s", time_s);
      const double at = origin->rest_s + time_s;
      const double whole = std::floor(at);
      return iso_text(origin->whole_s + static_cast<std::int64_t>(whole), at - whole,
                      origin->zone_known);
    };
    return context;
  }

  // Checks times of a wide table, whose signals share the times of the rows.
  void mind_jumps(const std::vector<std::pair<std::size_t, SignalTarget>>& columns) {
    const TimeFinding found = find_time_jumps(*times_, time_context());
    if (!found.problem.empty()) {
      const std::size_t row = turned_ ? times_->size() - found.row : found.row + 1;
      const std::size_t line = layout_.header_rows + row;
      throw RecordError(RecordError::Kind::data, line, 0,
                        fmt::format("{}:{}: {}", source_.name(), line, found.problem));
    }
    remarks_.insert(found.remarks.begin(), found.remarks.end());
    if (found.left_out.empty()) return;
    for (const auto& [column, target] : columns) leave_out(target.signal->value, found.left_out);
    leave_out(*times_, found.left_out);
  }

  static void leave_out(std::vector<double>& values, const std::vector<bool>& left_out) {
    std::size_t to = 0;
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (!left_out[k]) values[to++] = values[k];
    }
    values.resize(to);
  }

  // Orders a signal with separate times. Its rows may be in any order, but two overlapping
  // stretches are refused.
  void put_in_order(const SignalTarget& target) {
    Signal& signal = *target.signal;
    std::vector<double>& t = *signal.time_s;
    if (*target.error || t.empty()) return;
    std::size_t down = 0;
    for (std::size_t k = 1; k < t.size(); ++k) down += t[k] < t[k - 1] ? 1U : 0U;
    if (2 * down > t.size()) {
      std::reverse(t.begin(), t.end());
      std::reverse(signal.value.begin(), signal.value.end());
    }
    TimeContext context = time_context();
    context.may_be_sorted = true;
    context.same_value = [&signal](std::size_t a, std::size_t b) {
      return signal.value[a] == signal.value[b];
    };
    const TimeFinding found = find_time_jumps(t, context);
    if (!found.problem.empty()) {
      *target.error = RecordError(
          RecordError::Kind::data, 1, 0,
          fmt::format("{}: {}: at {} {}", source_.name(), base::in_quotes(target.name),
                      context.text(t[found.row > 0 ? found.row - 1 : 0]), found.problem));
      return;
    }
    for (const std::string& remark : found.remarks)
      remarks_.insert(fmt::format("{}: {}", base::in_quotes(target.name), remark));
    if (!found.left_out.empty()) {
      leave_out(signal.value, found.left_out);
      leave_out(t, found.left_out);
    }
    sort_by_time(signal);
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
  Layout layout_;  // of the present table
  const ImportOptions& options_;
  std::string_view line_;
  LineCells cells_;
  std::shared_ptr<std::vector<double>> times_;
  std::unordered_map<Signal*, Words> words_;
  std::unordered_map<Signal*, Watched> watched_;
  std::map<std::size_t, QualityCells> quality_cells_;      // by column
  std::map<std::size_t, QualityCells::Id> row_quality_{};  // of the row, by column
  std::set<std::string> remarks_;
  bool turned_ = false;  // rows were newest first
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
                              signals.mode_words.get(), name};
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
    part->remarks.assign(reader.remarks().begin(), reader.remarks().end());
  }
}

}  // namespace loopwarden::record
