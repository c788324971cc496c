// SPDX-License-Identifier: Apache-2.0
#include "record/import/layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <set>

#include "record/import/decimal_marks.hpp"
#include "record/import/number_text.hpp"
#include "record/import/quality.hpp"
#include "record/import/quality_columns.hpp"
#include "record/import/time_units.hpp"
#include "record/import/units.hpp"
#include "base/text.hpp"

namespace loopwarden::record {
namespace {

constexpr std::size_t kMostHeaderRows = 60;
constexpr double kNoHeader = -0.5;  // score of a row that names no columns

using Counts = std::map<std::size_t, std::size_t>;

Counts::const_iterator most_frequent(const Counts& counts) {
  return std::max_element(counts.begin(), counts.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; });
}

class Finder {
 public:
  Finder(std::string_view head, const std::string& name, const ImportOptions& options)
      : name_(name), options_(options) {
    while (!head.empty()) {
      const std::size_t end = std::min(head.find('\n'), head.size());
      std::string_view line = head.substr(0, end);
      head.remove_prefix(std::min(end + 1, head.size()));
      if (line.ends_with('\r')) line.remove_suffix(1);
      lines_.push_back(line);
    }
    while (!lines_.empty() && base::trimmed(lines_.back()).empty()) lines_.pop_back();
  }

  Layout find() {
    if (lines_.empty()) fail(0, 0, "the file is empty");
    find_delimiter();
    split();
    find_decimal();
    find_annotated();
    find_pairs();
    if (!layout_.pairs) {
      find_time();
      find_header();
      find_long();
      find_clock();
    }
    settle_decimal();
    layout_.qualities_of = find_qualities(layout_, options_.loops, with_words_of_quality());
    settle_form();
    return std::move(layout_);
  }

 private:
  [[noreturn]] void fail(std::size_t line, std::size_t column, const std::string& what) const {
    std::string place = name_;
    if (line > 0) place += fmt::format(":{}", line);
    if (column > 0) place += fmt::format(":{}", column);
    throw RecordError(RecordError::Kind::data, line, column, place + ": " + what);
  }

  // Returns the start of the second half of the lines, which are mostly rows of data.
  std::size_t bulk() const { return lines_.size() / 2; }

  std::set<std::size_t> with_words_of_quality() const {
    std::set<std::size_t> found;
    for (std::size_t c = 0; c < columns_ && layout_.is_long && !layout_.annotated; ++c) {
      if (c == layout_.clock) continue;
      bool good = false;
      bool all = true;
      for (std::size_t k = layout_.header_rows; k < rows_.size() && all; ++k) {
        const std::string_view text = cell(k, c);
        if (text.empty()) continue;
        good = good || says_good(text);
        all = text.size() > 1 && quality_of_word(text).has_value();
      }
      if (good && all) found.insert(c);
    }
    return found;
  }

  void find_delimiter() {
    if (options_.delimiter) {
      layout_.delimiter = *options_.delimiter;
      return;
    }
    double best = 0.0;
    for (const char candidate : {'\t', ';', '|', ','}) {
      Counts counts;
      LineCells cells;
      for (std::size_t k = bulk(); k < lines_.size(); ++k) {
        if (!cells.split(lines_[k], candidate)) continue;
        ++counts[cells.cells.size()];
      }
      const auto most = most_frequent(counts);
      if (most == counts.end() || most->first < 2) continue;
      const double agree =
          static_cast<double>(most->second) / static_cast<double>(lines_.size() - bulk());
      // Candidates are ordered, because numbers may contain commas as well.
      if (agree > best + 0.05) {
        best = agree;
        layout_.delimiter = candidate;
      }
    }
    if (best == 0.0) {
      fail(1, 1,
           "one column; a record has times and values, separated by a comma, semicolon, tab or bar "
           "(--delimiter for another one)");
    }
  }

  void split() {
    LineCells cells;
    for (std::size_t k = 0; k < lines_.size(); ++k) {
      std::size_t open = 0;
      if (!cells.split(lines_[k], layout_.delimiter, &open)) {
        fail(k + 1, place_in_line(lines_[k], open, options_), "no closing quote in this line");
      }
      rows_.emplace_back(cells.cells.begin(), cells.cells.end());
    }
    Counts counts;
    for (std::size_t k = bulk(); k < rows_.size(); ++k) ++counts[rows_[k].size()];
    columns_ = most_frequent(counts)->first;
    if (columns_ < 2) {
      fail(1, 1,
           fmt::format("one column: no cells are separated by {} (--delimiter)",
                       base::in_quotes(std::string(1, layout_.delimiter))));
    }
  }

  std::string_view name_of(std::size_t column) const {
    return column < layout_.names.size() ? std::string_view(layout_.names[column])
                                         : std::string_view();
  }

  std::string_view cell(std::size_t row, std::size_t column) const {
    return column < rows_[row].size() ? std::string_view(rows_[row][column]) : std::string_view();
  }

  void find_decimal() {
    if (options_.decimal) {
      layout_.decimal = *options_.decimal;
      return;
    }
    std::size_t commas = 0;
    std::size_t points = 0;
    std::size_t open_commas = 0;
    std::size_t open_points = 0;
    for (std::size_t k = bulk(); k < rows_.size(); ++k) {
      for (const std::string& text : rows_[k]) {
        switch (marks_of(split_cell(text).text)) {
          case Marks::comma_decimal: ++commas; break;
          case Marks::point_decimal: ++points; break;
          case Marks::comma_open: ++open_commas; break;
          case Marks::point_open: ++open_points; break;
          default: break;
        }
      }
    }
    layout_.decimal_known = commas + points > 0;
    if (!layout_.decimal_known) {
      commas = open_commas;
      points = open_points;
    }
    // With commas as delimiters, a decimal comma appears in quotes only: "1,5".
    const bool comma = layout_.delimiter == ',' ? commas > 0 && points == 0 : commas > points;
    if (comma) layout_.decimal = ',';
  }

  // Decides the decimal mark by the changes of each signal, if no cell allows one reading only.
  void settle_decimal() {
    if (layout_.decimal_known) return;
    std::map<std::string, MarkEvidence> signals;
    for (std::size_t k = layout_.header_rows; k < rows_.size(); ++k) {
      for (std::size_t c = 0; c < rows_[k].size(); ++c) {
        if (layout_.is_long ? c != layout_.value : c == layout_.time) continue;
        const std::string name(layout_.is_long ? cell(k, layout_.tag) : name_of(c));
        signals[name].add(split_cell(rows_[k][c]).text);
      }
    }
    std::set<char> by_jumps;
    std::set<char> by_outputs;
    for (const auto& [name, evidence] : signals) {
      if (const char mark = evidence.by_jumps(); mark != '\0') by_jumps.insert(mark);
      const bool output = is_output(name);
      if (const char mark = evidence.in_all_cells(); output && mark != '\0')
        by_outputs.insert(mark);
    }
    layout_.decimal_by_jumps = by_jumps.size() == 1;
    const std::set<char>& by = by_jumps.empty() ? by_outputs : by_jumps;
    if (by.size() == 1) layout_.decimal = *by.begin();
  }

  bool is_output(const std::string& name) const {
    if (options_.loops.empty()) return read_tag(name).role == Role::co;
    return std::any_of(options_.loops.begin(), options_.loops.end(), [&](const LoopSignals& loop) {
      return loop.names[index_of(Role::co)] == name;
    });
  }

  // Returns the share of cells of the column that are times of this form, among the rows of the
  // second half. For pairs: among all filled cells.
  double share_of_times(std::size_t column, TimeForm form) const {
    std::size_t good = 0;
    std::size_t all = 0;
    for (std::size_t k = layout_.pairs ? layout_.header_rows : bulk(); k < rows_.size(); ++k) {
      if (layout_.pairs && cell(k, column).empty()) continue;
      ++all;
      if (parse_time(cell(k, column), form, layout_.decimal)) ++good;
    }
    return all == 0 ? 0.0 : static_cast<double>(good) / static_cast<double>(all);
  }

  // Returns the row in which the column has a name for times.
  std::optional<std::size_t> row_naming_time(std::size_t column) const {
    for (std::size_t k = 0; k < std::min(rows_.size(), kMostHeaderRows); ++k) {
      if (parse_number(cell(k, column), layout_.decimal)) return std::nullopt;
      if (is_time_name(cell(k, column))) return k;
    }
    return std::nullopt;
  }
  bool named_like_time(std::size_t column) const { return row_naming_time(column).has_value(); }

  // Finds annotated CSV of InfluxDB: _start and _stop are times as well, and _measurement is no PV.
  void find_annotated() {
    for (std::size_t k = 0; k < std::min(rows_.size(), kMostHeaderRows); ++k) {
      const std::optional<std::size_t> time = column_in(k, "_time");
      if (!time || !(column_in(k, "_value") || column_in(k, "_measurement"))) continue;
      layout_.annotated = true;
      annotated_row_ = k;
      layout_.time = *time;
      return;
    }
  }

  std::optional<std::size_t> column_in(std::size_t row, std::string_view name) const {
    const auto at = std::find(rows_[row].begin(), rows_[row].end(), name);
    if (at == rows_[row].end()) return std::nullopt;
    return static_cast<std::size_t>(at - rows_[row].begin());
  }

  // Finds "Time,FIC101.PV,Time,FIC101.OP": columns of times, each followed by its values. If all
  // columns of times in a row are equal, this is a wide table instead.
  void find_pairs() {
    if (layout_.annotated || !options_.time_column.empty()) return;
    std::size_t width = 0;
    for (const auto& row : rows_) width = std::max(width, row.size());
    std::vector<std::size_t> values;
    std::size_t data = rows_.size();
    for (std::size_t c = 0; c < width; ++c) {
      if (is_blank(c)) continue;
      const std::size_t first = first_of_times(c);
      if (first == kNoColumn || c + 1 == width || is_blank(c + 1) ||
          first_of_times(c + 1) != kNoColumn)
        return;
      data = std::min(data, first);
      values.push_back(++c);
    }
    if (values.size() < 2) return;
    if (options_.header_rows) data = *options_.header_rows;
    std::size_t best = 0;
    std::vector<std::string> names;
    for (std::size_t k = 0; k < std::min(data, rows_.size()); ++k) {
      std::vector<std::string> here;
      std::set<std::string> distinct;
      std::size_t score = 0;
      for (const std::size_t c : values) {
        here.push_back(pair_name(k, c));
        if (!here.back().empty() && distinct.insert(here.back()).second) ++score;
        if (read_tag(here.back()).role) ++score;
      }
      if (distinct.size() < values.size() || distinct.count("") > 0 || score <= best) continue;
      best = score;
      names = std::move(here);
      name_row_ = k;
    }
    if (names.empty()) return;
    columns_ = width;
    layout_.pairs = true;
    layout_.header_rows = data;
    layout_.names.assign(width, "");
    layout_.units.assign(width, "");
    for (std::size_t k = 0; k < values.size(); ++k) layout_.names[values[k]] = names[k];
    const auto filled = [&](std::size_t c) {
      return std::count_if(rows_.begin(), rows_.end(),
                           [&](const auto& row) { return c < row.size() && !row[c].empty(); });
    };
    layout_.time =
        *std::max_element(values.begin(), values.end(),
                          [&](std::size_t a, std::size_t b) { return filled(a) < filled(b); }) -
        1;
    take_form(layout_.time);
    take_units(data);
  }

  bool is_blank(std::size_t column) const {
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      if (!cell(k, column).empty()) return false;
    }
    return true;
  }

  // Returns the row from which on a column has only times or empty cells; kNoColumn if it is no
  // column of times.
  std::size_t first_of_times(std::size_t column) const {
    const bool named = named_like_time(column);
    std::size_t first = kNoColumn;
    std::size_t times = 0;
    std::size_t others = 0;
    double last = 0.0;
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      const std::string_view text = cell(k, column);
      // "No events found" may follow the values.
      if (text.find_first_of("0123456789") == std::string_view::npos) continue;
      const auto number = parse_number(text, layout_.decimal);
      const bool time = number ? named && (times == 0 || *number >= last) : is_any_time(text);
      if (number) last = *number;
      if (time && first == kNoColumn) first = k;
      if (first != kNoColumn) ++(time ? times : others);
    }
    return times >= 2 && times >= 9 * others ? first : kNoColumn;
  }

  // Returns the name of a pair in a header's row: above its values, otherwise above its times.
  // Empty if neither cell is a name.
  std::string pair_name(std::size_t row, std::size_t value) const {
    for (const std::size_t c : {value, value - 1}) {
      std::string_view text = cell(row, c);
      for (const std::string_view ending : {" value", "_value", ".value"}) {
        if (text.size() > ending.size() &&
            base::lower_case(text.substr(text.size() - ending.size())) == ending)
          text.remove_suffix(ending.size());
      }
      // "StartTime,Value,EndTime,Status" names no signals.
      const bool time = c != value && !read_tag(text).role && is_time_name(text);
      if (!text.empty() && !time &&
          !one_of(base::lower_case(text),
                  {"value", "val", "wert", "data", "status", "quality", "q"}))
        return std::string(text);
    }
    return {};
  }

  bool rises(std::size_t column) const {
    double last = 0.0;
    std::size_t up = 0;
    std::size_t down = 0;
    for (std::size_t k = bulk(); k < rows_.size(); ++k) {
      const auto value = parse_number(cell(k, column), layout_.decimal);
      if (!value) return false;
      if (k > bulk()) ++(*value > last ? up : down);
      last = *value;
    }
    return up > 0 && down == 0;
  }

  void find_time() {
    constexpr double kMost = 0.9;
    if (!options_.time_column.empty()) {
      layout_.time = column_named(options_.time_column);
    } else if (!layout_.annotated) {
      std::optional<std::size_t> dates;
      std::optional<std::size_t> named;
      std::optional<std::size_t> rising;
      for (std::size_t c = 0; c < columns_; ++c) {
        const bool date = share_of_times(c, TimeForm::ymd) >= kMost ||
                          share_of_times(c, TimeForm::dmy) >= kMost ||
                          share_of_times(c, TimeForm::mdy) >= kMost;
        // Eight digits can be parsed as a date but may be a count.
        const bool number = share_of_times(c, TimeForm::seconds) >= kMost;
        if (date && !dates && (!number || named_like_time(c))) dates = c;
        if (number && named_like_time(c) && !named) named = c;
        if (number && !rising && c == 0 && rises(c)) rising = c;
      }
      // Numbers counted since 1970 have no order of day and month.
      if (dates && named && options_.time == TimeForm::automatic && has_two_orders(*dates) &&
          counts_since_1970(*named)) {
        dates = named;
      }
      if (dates) {
        layout_.time = *dates;
      } else if (named) {
        layout_.time = *named;
      } else if (rising) {
        layout_.time = *rising;
      } else {
        fail_no_time();
      }
    }
    if (options_.time != TimeForm::automatic) {
      layout_.form = options_.time;
      if (share_of_times(layout_.time, layout_.form) < kMost) {
        fail_time(layout_.time, fmt::format("of the form {}", to_text(layout_.form)));
      }
      return;
    }
    take_form(layout_.time);
  }

  // Returns whether all cells allow both orders of day and month.
  bool has_two_orders(std::size_t column) const {
    return share_of_times(column, TimeForm::ymd) < 0.9 &&
           share_of_times(column, TimeForm::dmy) >= 0.9 &&
           share_of_times(column, TimeForm::mdy) >= 0.9;
  }

  bool counts_since_1970(std::size_t column) const {
    return is_absolute(count_times(time_name(column), numbers_in(column, bulk())).form);
  }

  std::vector<double> numbers_in(std::size_t column, std::size_t from) const {
    std::vector<double> numbers;
    for (std::size_t k = from; k < rows_.size(); ++k) {
      if (const auto number = parse_number(cell(k, column), layout_.decimal))
        numbers.push_back(*number);
    }
    return numbers;
  }

  // Returns the name with its unit.
  std::string time_name(std::size_t column) const {
    std::string name;
    if (column < layout_.names.size()) {
      name = layout_.names[column];
    } else if (const auto row = row_naming_time(column)) {
      name = cell(*row, column);
    }
    if (column < layout_.units.size()) name += " " + layout_.units[column];
    return name;
  }

  // Determines the form of the column's times, if the user did not set it.
  void take_form(std::size_t c) {
    constexpr double kMost = 0.9;
    if (options_.time != TimeForm::automatic) {
      layout_.form = options_.time;
      return;
    }
    if (share_of_times(c, TimeForm::seconds) >= kMost && !compact_date(c)) {
      layout_.form = TimeForm::seconds;  // settle_form() looks closer
    } else if (share_of_times(c, TimeForm::ymd) >= kMost) {
      layout_.form = TimeForm::ymd;
    } else if (share_of_times(c, TimeForm::dmy) >= kMost ||
               share_of_times(c, TimeForm::mdy) >= kMost) {
      settle_order(c);
    } else {
      fail_time(c, kUnknownTime);
    }
  }

  // Returns whether times have the form 20260301 or 20260301T100000, which may also be numbers.
  bool compact_date(std::size_t column) const {
    const std::string_view text = cell(rows_.size() - 1, column);
    return text.size() >= 8 && share_of_times(column, TimeForm::ymd) >= 0.9 &&
           text.find('.') == text.npos && (text.starts_with("19") || text.starts_with("20")) &&
           text.size() == 8;
  }

  [[noreturn]] void fail_no_time() {
    // The error for a column named like times with unreadable cells is more specific than the
    // general one.
    for (std::size_t c = 0; c < columns_; ++c) {
      if (named_like_time(c)) fail_time(c, kUnknownTime);
    }
    fail(1, 1, "no column of times was found. Name it with --time-column NAME");
  }

  static constexpr const char* kUnknownTime = "that is known. Set its form with --time";

  bool is_any_time(std::string_view text) const {
    if (options_.time != TimeForm::automatic)
      return parse_time(text, options_.time, layout_.decimal).has_value();
    const DateOrder order = possible_orders(text);
    return order.dmy || order.mdy || parse_time(text, TimeForm::ymd, layout_.decimal) ||
           parse_number(text, layout_.decimal);
  }

  // Reports the first row below the column's name that is no time.
  [[noreturn]] void fail_time(std::size_t column, const std::string& of_what) {
    std::size_t row = kNoColumn;
    const std::size_t named = row_naming_time(column).value_or(0);
    for (std::size_t k = named; k < rows_.size(); ++k) {
      // The cell is in the wrong column because the row is too wide.
      if (rows_[k].size() > rows_[named].size() && rows_[named].size() > 1) {
        layout_.names.resize(rows_[named].size());
        fail(k + 1, 0, too_wide_text(rows_[k].size(), layout_));
      }
      const std::string_view text = cell(k, column);
      if (text.find_first_of("0123456789") == std::string_view::npos) continue;
      row = k;
      if (!is_any_time(text)) break;
    }
    if (row == kNoColumn) fail(rows_.size(), 0, "a header without a row of data below it");
    const std::string_view text = cell(row, column);
    fail(row + 1, place_in_line(lines_[row], lines_[row].find(text), options_),
         fmt::format("{} is no time {}", base::in_quotes(text), of_what));
  }

  std::size_t column_named(const std::string& wanted) const {
    for (std::size_t k = 0; k < std::min(rows_.size(), kMostHeaderRows); ++k) {
      for (std::size_t c = 0; c < rows_[k].size(); ++c) {
        if (rows_[k][c] == wanted || base::lower_case(rows_[k][c]) == base::lower_case(wanted))
          return c;
      }
    }
    std::size_t number = 0;
    const auto [end, problem] =
        std::from_chars(wanted.data(), wanted.data() + wanted.size(), number);
    if (problem == std::errc{} && end == wanted.data() + wanted.size() && number >= 1 &&
        number <= columns_) {
      return number - 1;
    }
    std::string names;
    for (const std::string& name : rows_.front())
      names += (names.empty() ? "" : ", ") + base::in_quotes(name);
    fail(1, 0, fmt::format("no column {}; the first line has {}", base::in_quotes(wanted), names));
  }

  // Decides whether day or month is first. In a date with dots the day is always first. Otherwise a
  // number above 12 decides, or the changes of the date: the correct order makes small steps.
  void settle_order(std::size_t column) {
    bool dmy = true;
    bool mdy = true;
    std::optional<TimePoint> last_dmy;
    std::optional<TimePoint> last_mdy;
    for (std::size_t k = bulk(); k < rows_.size() && dmy && mdy; ++k) {
      const std::string_view text = cell(k, column);
      const DateOrder order = possible_orders(text);
      if (!order.dmy && !order.mdy) continue;
      if (text.find('.') < text.find(':') && text.find('/') == text.npos &&
          text.find('-') == text.npos) {
        mdy = false;
        break;
      }
      dmy = dmy && order.dmy;
      mdy = mdy && order.mdy;
    }
    for (std::size_t k = 0; k < rows_.size() && dmy && mdy; ++k) {
      const auto as_dmy = parse_time(cell(k, column), TimeForm::dmy);
      const auto as_mdy = parse_time(cell(k, column), TimeForm::mdy);
      if (!as_dmy || !as_mdy) {
        dmy = dmy && (as_dmy || !as_mdy);
        mdy = mdy && (as_mdy || !as_dmy);
        continue;
      }
      constexpr double kLongStep = 3.0 * 86400.0;
      if (last_dmy) {
        const double day_first = std::abs(as_dmy->since(*last_dmy));
        const double month_first = std::abs(as_mdy->since(*last_mdy));
        if (day_first > kLongStep && month_first < kLongStep) dmy = false;
        if (month_first > kLongStep && day_first < kLongStep) mdy = false;
      }
      last_dmy = as_dmy;
      last_mdy = as_mdy;
    }
    if (dmy && mdy) {
      std::size_t row = 0;
      while (row + 1 < rows_.size() && !possible_orders(cell(row, column)).dmy) ++row;
      const std::string_view shown = cell(row, column);
      // A month written as a name is unambiguous.
      if (shown.find_first_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ") < 6) {
        mdy = false;
      } else if (options_.assume_order) {
        // AM and PM, and a month before a day with slashes, are of the same countries.
        const char last = static_cast<char>(shown.back() | 0x20);
        (last == 'm' || shown.find('/') != shown.npos ? dmy : mdy) = false;
        layout_.assumed =
            fmt::format("{} is read as {}; --time {} for the other order", base::in_quotes(shown),
                        dmy ? "day-month-year" : "month-day-year", dmy ? "mdy" : "dmy");
      } else {
        fail(row + 1, place_in_line(lines_[row], lines_[row].find(shown), options_),
             fmt::format("{} can be day-month-year and month-day-year: --time dmy or --time mdy",
                         base::in_quotes(shown)));
      }
    }
    layout_.form = dmy ? TimeForm::dmy : TimeForm::mdy;
  }

  bool is_data_row(std::size_t row) const {
    if (!parse_time(cell(row, layout_.time), layout_.form, layout_.decimal)) return false;
    for (std::size_t c = 0; c < rows_[row].size(); ++c) {
      if (c == layout_.time) continue;
      const Cell kind = parse_value(rows_[row][c], layout_.decimal, options_.bad_words).cell;
      if (kind != Cell::unknown) return true;
    }
    return false;
  }

  void find_header() {
    if (options_.header_rows) {
      layout_.header_rows = *options_.header_rows;
    } else {
      std::size_t first = 0;
      while (first < rows_.size() && !is_data_row(first)) ++first;
      if (first == rows_.size()) fail(rows_.size(), 0, "no row of values with a time was found");
      layout_.header_rows = first;
    }
    const std::size_t header = std::min(layout_.header_rows, rows_.size());
    // Finds the row with the most names of signals, the first one of several. Rows of descriptions
    // and units have fewer.
    std::size_t best_row = kNoColumn;
    double best = -1.0;
    for (std::size_t k = header > kMostHeaderRows ? header - kMostHeaderRows : 0; k < header; ++k) {
      double score = 0.0;
      std::set<std::string> distinct;
      for (const std::string& text : rows_[k]) {
        if (text.empty()) continue;
        distinct.insert(text);
        if (read_tag(text).role) score += 1.0;
        score -= is_unit(text) ? 0.5 : 0.0;
      }
      score += 0.5 * static_cast<double>(std::min(distinct.size(), columns_));
      if (rows_[k].size() > columns_ || distinct.size() < 2) score = kNoHeader;
      if (score > best) {
        best = score;
        best_row = k;
      }
    }
    if (layout_.annotated) {  // other tables may have more columns
      best_row = annotated_row_;
      columns_ = rows_[best_row].size();
    } else if (best_row != kNoColumn && best > kNoHeader) {
      refuse_wide_rows(best_row);
    }
    layout_.names.assign(columns_, "");
    layout_.units.assign(columns_, "");
    if (best_row == kNoColumn) {
      for (std::size_t c = 0; c < columns_; ++c) layout_.names[c] = std::to_string(c + 1);
      return;
    }
    name_row_ = best_row;
    for (std::size_t c = 0; c < columns_; ++c) layout_.names[c] = std::string(cell(best_row, c));
    take_units(header);
  }

  // Takes a row of units among the first lines.
  void take_units(std::size_t header) {
    for (std::size_t k = 0; k < header; ++k) {
      if (k == name_row_) continue;
      std::size_t units = 0;
      std::size_t filled = 0;
      for (std::size_t c = 0; c < columns_; ++c) {
        if (c == layout_.time || cell(k, c).empty()) continue;
        ++filled;
        std::string_view text = cell(k, c);
        if (text.size() > 2 && (text.front() == '[' || text.front() == '('))
          text = text.substr(1, text.size() - 2);
        if (is_unit(text)) ++units;
      }
      if (filled == 0 || 2 * units < filled) continue;
      for (std::size_t c = 0; c < columns_; ++c) layout_.units[c] = std::string(cell(k, c));
    }
  }

  // Refuses tables in which most rows have more cells than the header, because the cells can't be
  // assigned to columns. A single such row is reported when it is read. Additional empty cells
  // result from a delimiter at the end of the line.
  void refuse_wide_rows(std::size_t header) {
    const std::size_t named = rows_[header].size();
    std::size_t wide = 0;
    std::size_t first = 0;
    std::size_t cells = 0;
    for (std::size_t k = rows_.size(); k-- > layout_.header_rows;) {
      std::size_t filled = rows_[k].size();
      while (filled > named && rows_[k][filled - 1].empty()) --filled;
      if (filled <= named) continue;
      ++wide;
      first = k;
      cells = filled;
    }
    if (2 * wide > rows_.size() - layout_.header_rows) {
      layout_.names.resize(named);
      fail(first + 1, 0, too_wide_text(cells, layout_));
    }
    columns_ = std::min(columns_, named);
  }

  static bool one_of(const std::string& word, std::initializer_list<const char*> words) {
    return std::any_of(words.begin(), words.end(),
                       [&](const char* known) { return word == known; });
  }

  void find_long() {
    if (layout_.annotated) {
      take_annotated();
      return;
    }
    for (std::size_t c = 0; c < columns_; ++c) {
      if (c == layout_.time) continue;
      std::string word;
      for (const char letter : base::lower_case(layout_.names[c])) {
        if (letter != ' ' && letter != '_' && letter != '-' && letter != '.') word += letter;
      }
      if (one_of(word,
                 {"tag",       "tagname",    "tagid",     "name",     "point",     "pointname",
                  "pointid",   "item",       "itemid",    "itemname", "node",      "nodeid",
                  "signal",    "signalname", "signalid",  "variable", "varname",   "variablename",
                  "varid",     "variableid", "parameter", "series",   "metric",    "topic",
                  "attribute", "channel",    "path",      "sensor",   "sensorid",  "sensorname",
                  "tagkey",    "wwtagkey",   "valueid",   "archiv",   "messstelle"})) {
        if (layout_.tag == kNoColumn) layout_.tag = c;
      } else if (one_of(word, {"value", "val", "reading", "data", "wert", "valeur", "valor",
                               "vvalue", "varvalue", "realvalue", "tagvalue", "iptrendvalue",
                               "ipvalue", "messwert", "valore"})) {
        if (layout_.value == kNoColumn) layout_.value = c;
      }
    }
    if (layout_.tag == kNoColumn || layout_.value == kNoColumn) guess_long();
    layout_.is_long = layout_.tag != kNoColumn && layout_.value != kNoColumn;
    if (!layout_.is_long) layout_.tag = layout_.value = kNoColumn;
  }

  void take_annotated() {
    LineCells header;
    header.cells.assign(rows_[annotated_row_].begin(), rows_[annotated_row_].end());
    layout_.is_long = take_annotation(layout_, header);
    if (layout_.is_long) return;
    for (std::size_t c = 0; c < columns_; ++c) {  // each column is a field
      if (c != layout_.time && layout_.names[c].starts_with("_")) layout_.names[c].clear();
    }
  }

  // Recognises a long table without its names: three or four columns. One has words that repeat,
  // and one has numbers.
  void guess_long() {
    if (columns_ < 3 || columns_ > 5) return;
    std::size_t words = kNoColumn;
    std::size_t numbers = kNoColumn;
    for (std::size_t c = 0; c < columns_; ++c) {
      if (c == layout_.time) continue;
      std::size_t unknown = 0;
      std::size_t number = 0;
      std::set<std::string_view> distinct;
      std::size_t with_role = 0;
      for (std::size_t k = bulk(); k < rows_.size(); ++k) {
        const Cell kind = parse_value(cell(k, c), layout_.decimal, options_.bad_words).cell;
        if (kind == Cell::unknown) {
          ++unknown;
          distinct.insert(cell(k, c));
          if (const TagName tag = read_tag(cell(k, c)); tag.role && !tag.loop.empty()) ++with_role;
        }
        if (kind == Cell::number) ++number;
      }
      const std::size_t rows = rows_.size() - bulk();
      if (unknown == rows && 2 * with_role >= rows) words = c;
      if (2 * number > rows && numbers == kNoColumn) numbers = c;
    }
    if (words == kNoColumn || numbers == kNoColumn) return;
    layout_.tag = words;
    layout_.value = numbers;
  }

  // Finds the column of times of day, if dates are in a separate column: "Date;Time;PV;...".
  void find_clock() {
    if (!is_date(layout_.form)) return;
    bool only_dates = true;
    for (std::size_t k = layout_.header_rows; k < rows_.size(); ++k) {
      if (cell(k, layout_.time).find(':') != std::string_view::npos) only_dates = false;
    }
    if (!only_dates) return;
    for (std::size_t c = 0; c < columns_; ++c) {
      if (c != layout_.time && share_of_times(c, TimeForm::clock) >= 0.9 &&
          share_of_times(c, TimeForm::seconds) < 0.9) {
        layout_.clock = c;
        return;
      }
    }
  }

  // Decides the unit of numeric times by the name, otherwise by their size and their steps.
  void settle_form() {
    if (options_.time != TimeForm::automatic || layout_.form != TimeForm::seconds) return;
    const CountedTime counted =
        count_times(time_name(layout_.time), numbers_in(layout_.time, layout_.header_rows));
    if (!counted.question.empty()) {
      const std::size_t row = std::min(layout_.header_rows, rows_.size() - 1);
      fail(row + 1, place_in_line(lines_[row], lines_[row].find(cell(row, layout_.time)), options_),
           counted.question);
    }
    layout_.form = counted.form;
    layout_.hint = counted.hint;
  }

  const std::string& name_;
  const ImportOptions& options_;
  std::vector<std::string_view> lines_;
  std::vector<std::vector<std::string>> rows_;
  std::size_t columns_ = 0;
  std::size_t name_row_ = kNoColumn;
  std::size_t annotated_row_ = 0;
  Layout layout_;
};

}  // namespace

bool is_annotation(const Layout& layout, const LineCells& row) {
  return layout.annotated &&
         (row.cells.front().starts_with("#") ||
          std::find(row.cells.begin(), row.cells.end(), "_time") != row.cells.end());
}

// Reads an annotation. The tag consists of the parts that distinguish the series: measurement, tag
// columns, and the field unless it is "value".
bool take_annotation(Layout& layout, const LineCells& row) {
  if (row.cells.front() == "#default") layout.defaults.assign(row.cells.begin(), row.cells.end());
  if (row.cells.front().starts_with("#")) return true;
  const auto column = [&](std::string_view name) {
    const auto at = std::find(row.cells.begin(), row.cells.end(), name);
    return at == row.cells.end() ? kNoColumn : static_cast<std::size_t>(at - row.cells.begin());
  };
  const std::size_t time = column("_time");
  const std::size_t field = column("_field");
  const std::size_t value = column("_value");
  if (time == kNoColumn || field == kNoColumn || value == kNoColumn) return false;
  layout.time = time;
  layout.tag = field;
  layout.value = value;
  layout.names.assign(row.cells.begin(), row.cells.end());
  layout.more_of_tag.clear();
  for (std::size_t c = 0; c < layout.names.size(); ++c) {
    const std::string& name = layout.names[c];
    if (name == "_measurement" ||
        (!name.empty() && !name.starts_with("_") && name != "result" && name != "table")) {
      layout.more_of_tag.push_back(c);
    }
  }
  return true;
}

std::string_view tag_of(const Layout& layout, const LineCells& row, std::string& buffer) {
  if (row.cells.size() <= layout.tag || is_annotation(layout, row)) return {};
  if (!layout.annotated) return row.cells[layout.tag];
  buffer.clear();
  const auto add = [&](std::string_view part) {
    if (part.empty()) return;
    if (!buffer.empty()) buffer += '.';
    buffer += part;
  };
  const auto cell = [&](std::size_t c) -> std::string_view {
    if (c < row.cells.size() && !row.cells[c].empty()) return row.cells[c];
    return c < layout.defaults.size() ? std::string_view(layout.defaults[c]) : std::string_view();
  };
  for (const std::size_t c : layout.more_of_tag) add(cell(c));
  const std::string_view field = cell(layout.tag);
  if (field != "value" || buffer.empty()) add(field);
  return buffer;
}

namespace {

std::string delimiter_text(char c) {
  switch (c) {
    case ',': return "comma";
    case ';': return "semicolon";
    case '\t': return "tab";
    case '|': return "bar";
    default: return base::in_quotes(std::string(1, c));
  }
}

}  // namespace

std::string too_wide_text(std::size_t cells, const Layout& layout) {
  return fmt::format(
      "{} cells where the header has {}; a cell that contains the delimiter, a {}, must be in "
      "double quotes",
      cells, layout.names.size(), delimiter_text(layout.delimiter));
}

std::size_t place_in_line(std::string_view line, std::size_t byte, const ImportOptions& options) {
  if (!options.counts_columns || !options.delimiter) return byte + 1;
  return 1 +
         static_cast<std::size_t>(std::count(
             line.begin(), line.begin() + static_cast<std::ptrdiff_t>(std::min(byte, line.size())),
             *options.delimiter));
}

const char* to_text(Filling filling) noexcept {
  switch (filling) {
    case Filling::automatic: return "auto";
    case Filling::held: return "held";
    case Filling::linear: return "linear";
  }
  return "";
}

bool ImportOptions::anything_said() const noexcept {
  return delimiter || decimal || encoding != Encoding::automatic || header_rows ||
         time != TimeForm::automatic || !time_column.empty() || zone_s || !loops.empty() ||
         !rules.empty() || !bad_words.empty() || period_s || filling != Filling::automatic;
}

std::string fingerprint(const ImportOptions& o) {
  std::string text = fmt::format(
      "{} {} {} {} {} {} {} {} {}", o.delimiter.value_or(' '), o.decimal.value_or(' '),
      to_text(o.encoding), o.header_rows ? static_cast<long>(*o.header_rows) : -1L, to_text(o.time),
      o.time_column, o.zone_s.value_or(1), o.period_s.value_or(0.0), to_text(o.filling));
  for (const std::string& word : o.bad_words) text += "|" + word;
  for (const LoopSignals& loop : o.loops) {
    text += "|" + loop.tag;
    for (const std::string& name : loop.names) text += "," + name;
  }
  return text;
}

Layout find_layout(std::string_view head, const std::string& name, const ImportOptions& options) {
  return Finder(head, name, options).find();
}

namespace {

constexpr std::size_t kMostQualitiesSaid = 3;

std::string column_text(const Layout& layout) {
  return layout.pairs ? "" : " in column " + base::in_quotes(layout.names[layout.time]);
}

}  // namespace

std::vector<std::string> unused_columns(const Layout& layout) {
  std::vector<std::string> unused;
  if (!layout.is_long || layout.annotated) return unused;
  const std::vector<std::size_t> qualities = quality_columns(layout);
  const std::vector<std::size_t>& more = layout.more_of_tag;
  for (std::size_t c = 0; c < layout.names.size(); ++c) {
    const bool used = c == layout.time || c == layout.clock || c == layout.tag ||
                      c == layout.value || layout.names[c].empty() ||
                      std::find(more.begin(), more.end(), c) != more.end() ||
                      std::find(qualities.begin(), qualities.end(), c) != qualities.end();
    if (!used) unused.push_back(layout.names[c]);
  }
  return unused;
}

std::string describe(const Layout& layout, const TextSource& source) {
  std::string text = fmt::format(
      "{}{}, decimal {}, {}; times {}{}", source.packing().empty() ? "" : source.packing() + ", ",
      delimiter_text(layout.delimiter), layout.decimal == ',' ? "comma" : "point",
      to_text(source.encoding()), to_text(layout.form), column_text(layout));
  if (layout.clock != kNoColumn)
    text += fmt::format(" and {}", base::in_quotes(layout.names[layout.clock]));
  if (layout.annotated) text += "; as InfluxDB writes it";
  text += layout.is_long ? "; one row per value"
          : layout.pairs ? "; times and values in pairs of columns"
                         : "; one column per signal";
  const std::vector<std::size_t> qualities = quality_columns(layout);
  for (std::size_t k = 0; k < std::min(kMostQualitiesSaid, qualities.size()); ++k)
    text += (k > 0 ? ", " : "; qualities in ") + base::in_quotes(layout.names[qualities[k]]);
  if (qualities.size() > kMostQualitiesSaid) text += ", ...";
  const std::vector<std::string> unused = unused_columns(layout);
  for (std::size_t k = 0; k < std::min(kMostQualitiesSaid, unused.size()); ++k)
    text += (k > 0 ? ", " : "; not used: ") + base::in_quotes(unused[k]);
  if (unused.size() > kMostQualitiesSaid) text += ", ...";
  if (layout.header_rows != 1)
    text += fmt::format("; {} lines before the data", layout.header_rows);
  return text;
}

}  // namespace loopwarden::record
