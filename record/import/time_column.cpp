// SPDX-License-Identifier: Apache-2.0
#include "record/import/time_column.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

#include "base/text.hpp"
#include "record/import/number_text.hpp"

namespace loopwarden::record {
namespace {

constexpr double kMost = 0.9;  // of the cells of a column, for it to be one of times

bool whole_seconds(double s) {
  const double whole = std::nearbyint(s);
  return whole >= 1.0 && std::abs(s - whole) < 2e-3 * whole;
}

class TimeFinder {
 public:
  TimeFinder(const ExportHead& head, const ImportOptions& options, Layout& layout)
      : head_(head), options_(options), layout_(layout) {}

  void find_time() {
    if (!options_.time_column.empty()) {
      layout_.time = column_named(options_.time_column);
    } else if (!layout_.annotated) {
      std::optional<std::size_t> dates;
      std::optional<std::size_t> named;
      std::optional<std::size_t> rising;
      for (std::size_t c = 0; c < head_.columns; ++c) {
        const bool date = share_of_times(c, TimeForm::ymd) >= kMost ||
                          share_of_times(c, TimeForm::dmy) >= kMost ||
                          share_of_times(c, TimeForm::mdy) >= kMost;
        // Eight digits are a date to the eye of a machine and may be a count.
        const bool number = share_of_times(c, TimeForm::seconds) >= kMost;
        if (date && !dates && (!number || named_like_time(c))) dates = c;
        if (number && named_like_time(c) && !named) named = c;
        if (number && !rising && c == 0 && rises(c)) rising = c;
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
    const std::size_t c = layout_.time;
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

  // "Date;Time;PV;...": the times of day stand beside the dates.
  void find_clock() {
    if (!is_date(layout_.form)) return;
    bool only_dates = true;
    for (std::size_t k = layout_.header_rows; k < head_.rows.size(); ++k) {
      if (head_.cell(k, layout_.time).find(':') != std::string_view::npos) only_dates = false;
    }
    if (!only_dates) return;
    for (std::size_t c = 0; c < head_.columns; ++c) {
      if (c != layout_.time && share_of_times(c, TimeForm::clock) >= kMost &&
          share_of_times(c, TimeForm::seconds) < kMost) {
        layout_.clock = c;
        return;
      }
    }
  }

  // Numbers: how large they are and how far apart tells what they count, unless the name does.
  void settle_form() {
    if (options_.time != TimeForm::automatic || layout_.form != TimeForm::seconds) return;
    std::vector<double> times;
    for (std::size_t k = layout_.header_rows; k < head_.rows.size(); ++k) {
      if (const auto t = parse_number(head_.cell(k, layout_.time), layout_.decimal))
        times.push_back(*t);
    }
    if (times.size() < 2) return;
    std::vector<double> steps;
    for (std::size_t k = 1; k < times.size(); ++k) {
      if (times[k] != times[k - 1]) steps.push_back(std::abs(times[k] - times[k - 1]));
    }
    if (steps.empty()) return;
    std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2),
                     steps.end());
    const double step = steps[steps.size() / 2];
    const double at = times.front();
    std::string name = base::lower_case(layout_.names[layout_.time]);
    if (layout_.time < layout_.units.size())
      name += " " + base::lower_case(layout_.units[layout_.time]);
    const auto says = [&name](const char* part) { return name.find(part) != std::string::npos; };
    if (at > 1e8 && at < 1e10) {
      layout_.form = TimeForm::epoch_s;
    } else if (at > 1e11 && at < 1e13) {
      layout_.form = TimeForm::epoch_ms;
    } else if (at > 1e14 && at < 1e16) {
      layout_.form = TimeForm::epoch_us;
    } else if (at > 1e17 && at < 1e19) {
      layout_.form = TimeForm::epoch_ns;
    } else if (at > 25569.0 && at < 73051.0 && step < 0.5 && whole_seconds(step * 86400.0) &&
               !whole_seconds(step * 10.0)) {
      layout_.form = TimeForm::excel;
    } else if (says("minute") || says("[min]") || says("(min)") || says("_min") || name == "min" ||
               name.ends_with(" min")) {
      layout_.form = TimeForm::minutes;
    } else if (says("hour") || says("[h]") || says("(h)")) {
      layout_.form = TimeForm::hours;
    } else if (!says("sec") && !says("(s)") && !says("[s]") && !says("_s")) {
      layout_.hint = other_time_units(step);
    }
  }

 private:
  // Of the rows in the bulk, how many cells of the column are such times.
  double share_of_times(std::size_t column, TimeForm form) const {
    std::size_t good = 0;
    for (std::size_t k = head_.bulk(); k < head_.rows.size(); ++k) {
      if (parse_time(head_.cell(k, column), form, layout_.decimal)) ++good;
    }
    return static_cast<double>(good) / static_cast<double>(head_.rows.size() - head_.bulk());
  }

  // The row in which the column is named as times are.
  std::optional<std::size_t> row_naming_time(std::size_t column) const {
    for (std::size_t k = 0; k < std::min(head_.rows.size(), kMostHeaderRows); ++k) {
      if (parse_number(head_.cell(k, column), layout_.decimal)) return std::nullopt;
      const std::string word = base::lower_case(head_.cell(k, column));
      for (const char* part :
           {"time", "date", "zeit", "datum", "stamp", "heure", "fecha", "hora", "epoch"}) {
        if (word.find(part) != std::string::npos) return k;
      }
      if (word == "t" || word == "ts" || word == "t_s" || word == "sec" || word == "seconds")
        return k;
    }
    return std::nullopt;
  }

  bool named_like_time(std::size_t column) const { return row_naming_time(column).has_value(); }

  bool rises(std::size_t column) const {
    double last = 0.0;
    std::size_t up = 0;
    std::size_t down = 0;
    for (std::size_t k = head_.bulk(); k < head_.rows.size(); ++k) {
      const auto value = parse_number(head_.cell(k, column), layout_.decimal);
      if (!value) return false;
      if (k > head_.bulk()) ++(*value > last ? up : down);
      last = *value;
    }
    return up > 0 && down == 0;
  }

  // 20260301 or 20260301T100000: a number as well.
  bool compact_date(std::size_t column) const {
    const std::string_view text = head_.cell(head_.rows.size() - 1, column);
    return text.size() >= 8 && share_of_times(column, TimeForm::ymd) >= 0.9 &&
           text.find('.') == text.npos && (text.starts_with("19") || text.starts_with("20")) &&
           text.size() == 8;
  }

  [[noreturn]] void fail_no_time() const {
    // A column by that name whose cells can't be read says more than none.
    for (std::size_t c = 0; c < head_.columns; ++c) {
      if (named_like_time(c)) fail_time(c, kUnknownTime);
    }
    head_.fail(1, 1, "no column of times was found; --time-column NAME says which it is");
  }

  static constexpr const char* kUnknownTime = "that is known; --time tells its form";

  bool is_any_time(std::string_view text) const {
    if (options_.time != TimeForm::automatic)
      return parse_time(text, options_.time, layout_.decimal).has_value();
    const DateOrder order = possible_orders(text);
    return order.dmy || order.mdy || parse_time(text, TimeForm::ymd, layout_.decimal) ||
           parse_number(text, layout_.decimal);
  }

  // At the first row below the column's name that is no time.
  [[noreturn]] void fail_time(std::size_t column, const std::string& of_what) const {
    std::size_t row = kNoColumn;
    for (std::size_t k = row_naming_time(column).value_or(0); k < head_.rows.size(); ++k) {
      const std::string_view text = head_.cell(k, column);
      if (text.find_first_of("0123456789") == std::string_view::npos) continue;
      row = k;
      if (!is_any_time(text)) break;
    }
    if (row == kNoColumn) head_.fail(head_.rows.size(), 0, "a header, and no row of data below it");
    const std::string_view text = head_.cell(row, column);
    head_.fail(row + 1, head_.lines[row].find(text) + 1,
               fmt::format("{} is no time {}", base::in_quotes(text), of_what));
  }

  std::size_t column_named(const std::string& wanted) const {
    for (std::size_t k = 0; k < std::min(head_.rows.size(), kMostHeaderRows); ++k) {
      for (std::size_t c = 0; c < head_.rows[k].size(); ++c) {
        if (head_.rows[k][c] == wanted ||
            base::lower_case(head_.rows[k][c]) == base::lower_case(wanted))
          return c;
      }
    }
    std::size_t number = 0;
    const auto [end, problem] =
        std::from_chars(wanted.data(), wanted.data() + wanted.size(), number);
    if (problem == std::errc{} && end == wanted.data() + wanted.size() && number >= 1 &&
        number <= head_.columns) {
      return number - 1;
    }
    std::string names;
    for (const std::string& name : head_.rows.front())
      names += (names.empty() ? "" : ", ") + base::in_quotes(name);
    head_.fail(1, 0,
               fmt::format("no column {}; the first line has {}", base::in_quotes(wanted), names));
  }

  // Day or month first. A date with dots has the day first everywhere; else numbers above 12 tell, or the change of
  // the date: time goes on by little.
  void settle_order(std::size_t column) {
    bool dmy = true;
    bool mdy = true;
    std::optional<TimePoint> last_dmy;
    std::optional<TimePoint> last_mdy;
    for (std::size_t k = head_.bulk(); k < head_.rows.size() && dmy && mdy; ++k) {
      const std::string_view text = head_.cell(k, column);
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
    for (std::size_t k = 0; k < head_.rows.size() && dmy && mdy; ++k) {
      const auto as_dmy = parse_time(head_.cell(k, column), TimeForm::dmy);
      const auto as_mdy = parse_time(head_.cell(k, column), TimeForm::mdy);
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
      while (row + 1 < head_.rows.size() && !possible_orders(head_.cell(row, column)).dmy) ++row;
      const std::string_view shown = head_.cell(row, column);
      // The name of a month leaves no choice.
      if (shown.find_first_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ") < 6) {
        mdy = false;
      } else {
        head_.fail(
            row + 1, head_.lines[row].find(shown) + 1,
            fmt::format("{} can be day-month-year and month-day-year: --time dmy or --time mdy",
                        base::in_quotes(shown)));
      }
    }
    layout_.form = dmy ? TimeForm::dmy : TimeForm::mdy;
  }

  const ExportHead& head_;
  const ImportOptions& options_;
  Layout& layout_;
};

}  // namespace

void find_time(const ExportHead& head, const ImportOptions& options, Layout& layout) {
  TimeFinder(head, options, layout).find_time();
}

void find_clock(const ExportHead& head, const ImportOptions& options, Layout& layout) {
  TimeFinder(head, options, layout).find_clock();
}

void settle_form(const ExportHead& head, const ImportOptions& options, Layout& layout) {
  TimeFinder(head, options, layout).settle_form();
}

// 1/60 of a minute: whole seconds, and no sample rate that anybody chooses.
std::string other_time_units(double step_s) {
  if (step_s >= 0.5 || !whole_seconds(step_s * 60.0) || whole_seconds(step_s * 200.0)) return {};
  return fmt::format("a step of {:.6g} s looks like {:.4g} s in minutes: --time minutes if it is",
                     step_s, step_s * 60.0);
}

}  // namespace loopwarden::record
