// SPDX-License-Identifier: Apache-2.0
#include "record/import/time_text.hpp"

#include <date/date.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "record/import/number_text.hpp"

namespace loopwarden::record {
namespace {

struct FormName {
  TimeForm form;
  const char* name;
};
constexpr std::array kForms{FormName{TimeForm::automatic, "auto"},
                            FormName{TimeForm::seconds, "seconds"},
                            FormName{TimeForm::minutes, "minutes"},
                            FormName{TimeForm::hours, "hours"},
                            FormName{TimeForm::milliseconds, "milliseconds"},
                            FormName{TimeForm::microseconds, "microseconds"},
                            FormName{TimeForm::nanoseconds, "nanoseconds"},
                            FormName{TimeForm::epoch_s, "epoch-s"},
                            FormName{TimeForm::epoch_ms, "epoch-ms"},
                            FormName{TimeForm::epoch_us, "epoch-us"},
                            FormName{TimeForm::epoch_ns, "epoch-ns"},
                            FormName{TimeForm::excel, "excel"},
                            FormName{TimeForm::ymd, "ymd"},
                            FormName{TimeForm::dmy, "dmy"},
                            FormName{TimeForm::mdy, "mdy"},
                            FormName{TimeForm::clock, "clock"}};

constexpr std::int64_t kDay = 86400;

constexpr bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }

class Scanner {
 public:
  explicit Scanner(std::string_view text) : rest_(text) {}

  bool at_end() const noexcept { return rest_.empty(); }
  char next() const noexcept { return rest_.empty() ? '\0' : rest_.front(); }
  std::size_t digits() const noexcept {
    std::size_t n = 0;
    while (n < rest_.size() && is_digit(rest_[n])) ++n;
    return n;
  }
  // Takes one of `characters`; '\0' if another one follows.
  char take(std::string_view characters) noexcept {
    if (rest_.empty() || characters.find(rest_.front()) == std::string_view::npos) return '\0';
    const char c = rest_.front();
    rest_.remove_prefix(1);
    return c;
  }
  void skip_spaces() noexcept {
    while (!rest_.empty() && rest_.front() == ' ') rest_.remove_prefix(1);
  }
  // Returns -1 if there is no number of at most that many digits.
  int number(std::size_t most) noexcept {
    int value = 0;
    std::size_t n = 0;
    while (n < most && n < rest_.size() && is_digit(rest_[n])) {
      value = 10 * value + (rest_[n] - '0');
      ++n;
    }
    rest_.remove_prefix(n);
    return n == 0 ? -1 : value;
  }
  double fraction() noexcept {
    double value = 0.0;
    double scale = 0.1;
    while (!rest_.empty() && is_digit(rest_.front())) {
      value += scale * (rest_.front() - '0');
      scale /= 10.0;
      rest_.remove_prefix(1);
    }
    return value;
  }
  // Returns 1 to 12 for the first three letters of an English month, and skips the letters after
  // them; 0: no month.
  int month_name() noexcept {
    constexpr std::string_view kNames = "janfebmaraprmayjunjulaugsepoctnovdec";
    if (rest_.size() < 3) return 0;
    std::array<char, 3> word{};
    for (std::size_t k = 0; k < 3; ++k) word[k] = static_cast<char>(rest_[k] | 0x20);
    for (std::size_t m = 0; m < 12; ++m) {
      if (kNames.substr(3 * m, 3) != std::string_view(word.data(), 3)) continue;
      while (!rest_.empty() && (rest_.front() | 0x20) >= 'a' && (rest_.front() | 0x20) <= 'z') {
        rest_.remove_prefix(1);
      }
      return static_cast<int>(m) + 1;
    }
    return 0;
  }
  std::string_view letters() const noexcept {
    std::size_t n = 0;
    while (n < rest_.size() && (rest_[n] | 0x20) >= 'a' && (rest_[n] | 0x20) <= 'z') ++n;
    return rest_.substr(0, n);
  }
  void skip(std::size_t characters) noexcept { rest_.remove_prefix(characters); }
  // Skips "Tue ", "Di, ": recognised by two letters, English or German.
  void skip_weekday() noexcept {
    constexpr std::string_view kDays = "mo tu we th fr sa su di mi do so ";
    const std::string_view name = letters();
    if (name.size() < 2) return;
    const std::array<char, 3> start{static_cast<char>(name[0] | 0x20),
                                    static_cast<char>(name[1] | 0x20), ' '};
    if (kDays.find(std::string_view(start.data(), start.size())) == kDays.npos) return;
    skip(name.size());
    take(".");
    take(",");
    skip_spaces();
  }
  bool word(std::string_view lower) noexcept {
    if (rest_.size() < lower.size()) return false;
    for (std::size_t k = 0; k < lower.size(); ++k) {
      const char c =
          rest_[k] >= 'A' && rest_[k] <= 'Z' ? static_cast<char>(rest_[k] + 32) : rest_[k];
      if (c != lower[k]) return false;
    }
    rest_.remove_prefix(lower.size());
    return true;
  }

 private:
  std::string_view rest_;
};

struct Date {
  int first = 0;  // as written, to find the order
  int second = 0;
  bool named = false;  // the month is a name
  bool year_first = false;
  int year = 0, month = 0, day = 0;
};

constexpr int full_year(int year, std::size_t digits) noexcept {
  if (digits > 2) return year;
  return year < 70 ? 2000 + year : 1900 + year;
}

bool read_date(Scanner& in, Date& date) {
  const std::size_t digits = in.digits();
  if (digits == 8) {  // 20260301
    date.year_first = true;
    date.year = in.number(4);
    date.month = in.number(2);
    date.day = in.number(2);
    return date.year >= 1900 && date.year <= 2200;  // other years: it may be a count
  }
  if (digits == 4) {
    date.year_first = true;
    date.year = in.number(4);
    if (in.take("-/.") == '\0') return false;
    date.month = in.month_name();
    if (date.month == 0) date.month = in.number(2);
    if (in.take("-/.") == '\0') return false;
    date.day = in.number(2);
    return date.month > 0 && date.day > 0;
  }
  if (digits < 1 || digits > 2) return false;
  date.first = in.number(2);
  if (in.take("-/. ") == '\0') return false;
  date.month = in.month_name();
  date.named = date.month > 0;
  date.second = date.named ? date.month : in.number(2);
  if (in.take("-/. ") == '\0') return false;
  const std::size_t year_digits = in.digits();
  if (year_digits != 4 && year_digits != 2) return false;
  date.year = full_year(in.number(4), year_digits);
  return date.second > 0;
}

// Returns the seconds of the day; negative if it is no time.
double read_clock(Scanner& in, bool digits_only) {
  const int hour = in.number(2);
  double second = 0.0;
  if (hour < 0 || hour > 24) return -1.0;
  if (!digits_only && in.take(":.") == '\0') return -1.0;
  const int minute = in.number(2);
  if (minute < 0 || minute > 59) return -1.0;
  const bool more = digits_only ? in.digits() > 0 : in.take(":.") != '\0';
  if (more) {
    const int whole = in.number(2);
    if (whole < 0 || whole > 60) return -1.0;
    second = whole;
    if (in.take(".,") != '\0') second += in.fraction();
  }
  in.skip_spaces();
  int shift = 0;
  if (in.word("am") || in.word("a.m.")) {
    if (hour > 12) return -1.0;
    shift = hour == 12 ? -12 : 0;
  } else if (in.word("pm") || in.word("p.m.")) {
    if (hour > 12) return -1.0;
    shift = hour == 12 ? 0 : 12;
  }
  return 3600.0 * (hour + shift) + 60.0 * minute + second;
}

struct ZoneName {
  std::string_view name;  // lower case
  int minutes;            // east of UTC
};
// Zones of North America as in RFC 822. A name of several zones (IST) is not listed.
constexpr std::array kZones{
    ZoneName{"z", 0},      ZoneName{"utc", 0},    ZoneName{"gmt", 0},    ZoneName{"wet", 0},
    ZoneName{"west", 60},  ZoneName{"bst", 60},   ZoneName{"cet", 60},   ZoneName{"met", 60},
    ZoneName{"mez", 60},   ZoneName{"cest", 120}, ZoneName{"mest", 120}, ZoneName{"mesz", 120},
    ZoneName{"eet", 120},  ZoneName{"eest", 180}, ZoneName{"msk", 180},  ZoneName{"sast", 120},
    ZoneName{"est", -300}, ZoneName{"edt", -240}, ZoneName{"cst", -360}, ZoneName{"cdt", -300},
    ZoneName{"mst", -420}, ZoneName{"mdt", -360}, ZoneName{"pst", -480}, ZoneName{"pdt", -420},
    ZoneName{"jst", 540},  ZoneName{"kst", 540},  ZoneName{"hkt", 480},  ZoneName{"sgt", 480},
    ZoneName{"awst", 480}, ZoneName{"aest", 600}, ZoneName{"aedt", 660}, ZoneName{"nzst", 720},
    ZoneName{"nzdt", 780}};

bool read_zone(Scanner& in, int& offset_s) {
  offset_s = 0;
  const std::string_view name = in.letters();
  if (!name.empty()) {
    const auto at = std::find_if(kZones.begin(), kZones.end(), [&](const ZoneName& zone) {
      return zone.name.size() == name.size() &&
             std::equal(name.begin(), name.end(), zone.name.begin(),
                        [](char a, char b) { return (a | 0x20) == b; });
    });
    if (at == kZones.end()) return false;
    in.skip(name.size());
    offset_s = 60 * at->minutes;
    if (in.next() != '+' && in.next() != '-') return true;
    if (offset_s != 0) return false;
  }
  const char sign = in.take("+-");
  if (sign == '\0') return false;
  const int hours = in.number(2);
  in.take(":");
  const int minutes = in.digits() > 0 ? in.number(2) : 0;
  if (hours < 0 || hours > 14 || minutes > 59) return false;
  offset_s = (sign == '-' ? -1 : 1) * (3600 * hours + 60 * minutes);
  return true;
}

// Returns nullopt if there is no such day. Zero times of clocks (years 1, 1601, 1899) are valid
// days, which time_jumps.hpp leaves out.
std::optional<TimePoint> point_at(const Date& written, double of_day_s) {
  const date::year_month_day day = date::year(written.year) / written.month / written.day;
  if (written.year < 1 || written.year > 9999 || !day.ok()) return std::nullopt;
  TimePoint point;
  const double whole = std::floor(of_day_s);
  point.whole_s =
      kDay * date::sys_days(day).time_since_epoch().count() + static_cast<std::int64_t>(whole);
  point.rest_s = of_day_s - whole;
  return point;
}

// Reads the text after a date: empty, or a time of day with an optional zone.
std::optional<TimePoint> with_clock(Scanner& in, const Date& written) {
  in.take(",");
  if (in.take("Tt") == '\0') in.skip_spaces();
  if (in.at_end()) return point_at(written, 0.0);
  const double of_day = read_clock(in, in.digits() >= 4);
  if (of_day < 0.0) return std::nullopt;
  auto point = point_at(written, of_day);
  in.skip_spaces();
  if (!point || in.at_end()) return point;
  int offset_s = 0;
  if (!read_zone(in, offset_s)) return std::nullopt;
  in.skip_spaces();
  if (!in.at_end() && in.next() != '(') return std::nullopt;  // (Central European Standard Time)
  point->whole_s -= offset_s;
  point->zone_known = true;
  return point;
}

// Reads times as Java, C and JavaScript print them: Nov 24 13:05:22 CET 2026, Nov 24 13:05:22 2026,
// Nov 24 2026 13:05:22 GMT+0100.
std::optional<TimePoint> month_first(Scanner& in) {
  Date written;
  written.month = in.month_name();
  in.take(".");
  in.skip_spaces();
  written.day = in.number(2);
  if (written.month == 0 || written.day < 1) return std::nullopt;
  in.take(",");
  in.skip_spaces();
  if (in.digits() == 4) {
    written.year = in.number(4);
    return with_clock(in, written);
  }
  const double of_day = read_clock(in, false);
  if (of_day < 0.0) return std::nullopt;
  in.skip_spaces();
  bool zone_known = false;
  int offset_s = 0;
  if (in.digits() == 0) {
    zone_known = read_zone(in, offset_s);
    if (!zone_known) {  // with an unknown zone name it is a local time
      if (in.letters().empty()) return std::nullopt;
      in.skip(in.letters().size());
    }
    in.skip_spaces();
  }
  if (in.digits() != 4) return std::nullopt;
  written.year = in.number(4);
  if (!in.at_end()) return std::nullopt;
  auto point = point_at(written, of_day);
  if (!point) return std::nullopt;
  point->whole_s -= offset_s;
  point->zone_known = zone_known;
  return point;
}

std::optional<TimePoint> parse_date(std::string_view text, TimeForm form) {
  Scanner in(text);
  if (in.digits() == 0) {
    in.skip_weekday();
    if (in.digits() == 0) return month_first(in);
  }
  Date written;
  if (!read_date(in, written)) return std::nullopt;
  if (written.year_first != (form == TimeForm::ymd)) {
    if (written.year_first || !written.named) return std::nullopt;
  }
  if (!written.year_first) {
    const bool day_first = written.named || form == TimeForm::dmy;
    written.day = day_first ? written.first : written.second;
    written.month = day_first ? written.second : written.first;
  }
  return with_clock(in, written);
}

// Returns nullopt if an int64 can't hold it.
std::optional<TimePoint> from_seconds(double whole_units, double units_per_s, bool zone_known) {
  constexpr double kFurthest_s = 4e18;  // the difference of two must fit an int64 as well
  TimePoint point;
  const double whole = std::floor(whole_units / units_per_s);
  if (!(std::abs(whole) <= kFurthest_s)) return std::nullopt;
  point.whole_s = static_cast<std::int64_t>(whole);
  point.rest_s = (whole_units - whole * units_per_s) / units_per_s;
  point.zone_known = zone_known;
  return point;
}

}  // namespace

const char* to_text(TimeForm form) noexcept {
  for (const FormName& known : kForms) {
    if (known.form == form) return known.name;
  }
  return "";
}

std::optional<TimeForm> time_form(std::string_view name) noexcept {
  for (const FormName& known : kForms) {
    if (name == known.name) return known.form;
  }
  return std::nullopt;
}

bool is_date(TimeForm form) noexcept {
  return form == TimeForm::ymd || form == TimeForm::dmy || form == TimeForm::mdy;
}

bool is_absolute(TimeForm form) noexcept {
  return is_date(form) || form == TimeForm::epoch_s || form == TimeForm::epoch_ms ||
         form == TimeForm::epoch_us || form == TimeForm::epoch_ns || form == TimeForm::excel;
}

std::optional<TimePoint> parse_time(std::string_view text, TimeForm form, char decimal) {
  if (is_date(form)) return parse_date(text, form);
  if (form == TimeForm::clock) {
    Scanner in(text);
    const double of_day = read_clock(in, false);
    if (of_day < 0.0 || !in.at_end()) return std::nullopt;
    return from_seconds(of_day, 1.0, false);
  }
  const std::optional<double> number = parse_number(text, decimal);
  if (!number) return std::nullopt;
  switch (form) {
    case TimeForm::milliseconds: return from_seconds(*number, 1e3, false);
    case TimeForm::microseconds: return from_seconds(*number, 1e6, false);
    case TimeForm::nanoseconds: return from_seconds(*number, 1e9, false);
    case TimeForm::minutes: return from_seconds(*number * 60.0, 1.0, false);
    case TimeForm::hours: return from_seconds(*number * 3600.0, 1.0, false);
    case TimeForm::epoch_s: return from_seconds(*number, 1.0, true);
    case TimeForm::epoch_ms: return from_seconds(*number, 1e3, true);
    case TimeForm::epoch_us: return from_seconds(*number, 1e6, true);
    case TimeForm::epoch_ns: return from_seconds(*number, 1e9, true);
    case TimeForm::excel:
      // A double holds such a day to a microsecond; spreadsheets round to the millisecond.
      return from_seconds(std::nearbyint((*number - 25569.0) * 86400.0 * 1e3), 1e3, false);
    default: return from_seconds(*number, 1.0, false);
  }
}

DateOrder possible_orders(std::string_view text) {
  return {.dmy = parse_date(text, TimeForm::dmy).has_value(),
          .mdy = parse_date(text, TimeForm::mdy).has_value()};
}

std::string iso_text(std::int64_t whole_s, double rest_s, bool utc) {
  std::int64_t days = whole_s / kDay;
  if (whole_s < days * kDay) --days;
  const std::int64_t of_day = whole_s - days * kDay;
  const std::int64_t z = days + 719468;
  const std::int64_t era = (z >= 0 ? z : z - 146096) / 146097;
  const std::int64_t day_of_era = z - era * 146097;
  const std::int64_t year_of_era =
      (day_of_era - day_of_era / 1460 + day_of_era / 36524 - day_of_era / 146096) / 365;
  const std::int64_t day_of_year =
      day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
  const std::int64_t shifted = (5 * day_of_year + 2) / 153;
  const std::int64_t day = day_of_year - (153 * shifted + 2) / 5 + 1;
  const std::int64_t month = shifted < 10 ? shifted + 3 : shifted - 9;
  const std::int64_t year = year_of_era + era * 400 + (month <= 2 ? 1 : 0);
  const int ms = static_cast<int>(rest_s * 1e3);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}{}{}", year, month, day, of_day / 3600,
                     of_day / 60 % 60, of_day % 60, ms > 0 ? fmt::format(".{:03}", ms) : "",
                     utc ? "Z" : "");
}

std::optional<int> zone_offset_s(std::string_view text) noexcept {
  Scanner in(text);
  int offset_s = 0;
  if (!read_zone(in, offset_s) || !in.at_end()) return std::nullopt;
  return offset_s;
}

}  // namespace loopwarden::record
