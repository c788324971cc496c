// SPDX-License-Identifier: Apache-2.0
#include "record/import/time_units.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/text.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::record {
namespace {

constexpr std::array kUsualSeconds{0.01,   0.02,    0.05,    0.1,     0.2,     0.25,    0.5,
                                   1.0,    2.0,     3.0,     4.0,     5.0,     6.0,     10.0,
                                   12.0,   15.0,    20.0,    30.0,    60.0,    120.0,   180.0,
                                   240.0,  300.0,   600.0,   900.0,   1200.0,  1800.0,  3600.0,
                                   7200.0, 10800.0, 14400.0, 21600.0, 28800.0, 43200.0, 86400.0};
constexpr double kLongStep = 90.0;     // s, from which on the unit may be another one
constexpr double kUsualWithin = 0.02;  // of a usual period
constexpr double kRegularShare = 0.7;  // of the steps near their median

bool whole_seconds(double s) {
  const double whole = std::nearbyint(s);
  return whole >= 1.0 && std::abs(s - whole) < 2e-3 * whole;
}

bool is_usual(double step_s) {
  return std::any_of(kUsualSeconds.begin(), kUsualSeconds.end(), [step_s](double usual) {
    return std::abs(step_s / usual - 1.0) < kUsualWithin;
  });
}

// Splits "TimeMs", "t[ms]" and "time_ms" into words: "time", "ms".
std::vector<std::string> words_of(std::string_view name) {
  std::vector<std::string> words(1);
  bool lower = false;
  for (const char c : name) {
    const bool upper = c >= 'A' && c <= 'Z';
    const bool letter = upper || (c >= 'a' && c <= 'z') || static_cast<unsigned char>(c) >= 0x80;
    if (!letter || (upper && lower)) words.emplace_back();
    if (letter) words.back() += c;
    lower = letter && !upper;
  }
  for (std::string& word : words) word = base::lower_case(word);
  std::erase_if(words, [](const std::string& word) { return word.empty(); });
  return words;
}

struct UnitWords {
  TimeForm form;
  std::string_view words;  // each between blanks
};
constexpr std::array kUnitWords{
    UnitWords{
        TimeForm::milliseconds,
        " ms msec msecs millis milli millisec millisecs millisecond milliseconds"
        " millisekunde millisekunden milliseconde millisecondes milisegundo milisegundos"
        " millisecondi milissegundos \u6beb\u79d2 \u30df\u30ea\u79d2 \u043c\u0441 timems tms "},
    UnitWords{TimeForm::microseconds,
              " us \u00b5s \u03bcs usec usecs micros microsec microsecs microsecond microseconds"
              " mikrosekunde mikrosekunden microsecondes microsegundos microsecondi \u5fae\u79d2"
              " \u043c\u043a\u0441 timeus tus "},
    UnitWords{TimeForm::nanoseconds,
              " ns nsec nsecs nanos nanosec nanosecond nanoseconds nanosekunden nanosecondes"
              " nanosegundos \u7eb3\u79d2 \u043d\u0441 timens tns "},
    UnitWords{TimeForm::seconds,
              " s sec secs second seconds sek sekunde sekunden seconde secondes segundo segundos"
              " secondi \u79d2 "},
    UnitWords{TimeForm::minutes,
              " min mins minute minutes minuten minuto minutos minuti \u5206\u949f "},
    UnitWords{TimeForm::hours,
              " h hr hrs hour hours std stunde stunden heures hora horas ore \u5c0f\u65f6 "}};

bool lists_word(std::string_view list, const std::string& word) {
  return list.find(' ' + word + ' ') != list.npos;
}

double seconds_in(TimeForm form) {
  switch (form) {
    case TimeForm::milliseconds: return 1e-3;
    case TimeForm::microseconds: return 1e-6;
    case TimeForm::nanoseconds: return 1e-9;
    default: return 1.0;
  }
}

// Returns the unit if numbers of this size can be counted from 1970.
TimeForm since_1970(double at) {
  if (at > 1e8 && at < 1e10) return TimeForm::epoch_s;
  if (at > 1e11 && at < 1e13) return TimeForm::epoch_ms;
  if (at > 1e14 && at < 1e16) return TimeForm::epoch_us;
  return at > 1e17 && at < 1e19 ? TimeForm::epoch_ns : TimeForm::automatic;
}

TimeForm counted_from_start(TimeForm epoch) {
  switch (epoch) {
    case TimeForm::epoch_ms: return TimeForm::milliseconds;
    case TimeForm::epoch_us: return TimeForm::microseconds;
    case TimeForm::epoch_ns: return TimeForm::nanoseconds;
    default: return TimeForm::seconds;
  }
}

// Asks for the unit of whole numbers whose steps are no usual period in seconds, but one in a
// smaller unit.
std::string unit_question(const std::vector<double>& times, const std::vector<double>& steps,
                          double step) {
  const bool whole =
      std::all_of(times.begin(), times.end(), [](double t) { return t == std::nearbyint(t); });
  const auto near = std::count_if(steps.begin(), steps.end(),
                                  [step](double s) { return std::abs(s - step) <= step / 3.0; });
  if (!whole || step < kLongStep || is_usual(step) ||
      static_cast<double>(near) < kRegularShare * static_cast<double>(steps.size()))
    return {};
  std::string others;
  for (const TimeForm form :
       {TimeForm::milliseconds, TimeForm::microseconds, TimeForm::nanoseconds}) {
    const double step_s = step * seconds_in(form);
    if (is_usual(step_s)) others += fmt::format(" or --time {} ({:.4g} s)", to_text(form), step_s);
  }
  if (others.empty()) return {};
  return fmt::format("steps of {:.6g}, and no unit in the name: --time seconds ({:.6g} s){}", step,
                     step, others);
}

}  // namespace

TimeForm time_unit_of(std::string_view name) {
  // The last word that is a unit decides: "Time in ms", "seconds since start (ms)".
  TimeForm found = TimeForm::automatic;
  for (const std::string& word : words_of(name)) {
    for (const UnitWords& unit : kUnitWords) {
      if (lists_word(unit.words, word)) found = unit.form;
    }
  }
  return found;
}

bool is_time_name(std::string_view name) {
  const std::string lower = base::lower_case(name);
  for (const char* part : {"time", "date", "zeit", "datum", "stamp", "heure", "fecha", "hora",
                           "epoch", "elapsed", "uptime", "\u65f6\u95f4", "\u6642\u523b",
                           "\u65e5\u671f", "\u0432\u0440\u0435\u043c\u044f"}) {
    if (lower.find(part) != lower.npos) return true;
  }
  // Accepts t or ts with units, or a single small unit; min and std are often statistics.
  const std::vector<std::string> words = words_of(name);
  const auto is_unit = [](const std::string& word) {
    return word == "in" || time_unit_of(word) != TimeForm::automatic;
  };
  if (words.empty()) return false;
  if (words.front() == "t" || words.front() == "ts")
    return std::all_of(words.begin() + 1, words.end(), is_unit);
  const TimeForm unit = time_unit_of(words.front());
  return words.size() == 1 && words.front().size() > 1 && unit != TimeForm::automatic &&
         unit != TimeForm::minutes && unit != TimeForm::hours;
}

CountedTime count_times(std::string_view name, const std::vector<double>& times) {
  CountedTime found;
  std::vector<double> steps;
  for (std::size_t k = 1; k < times.size(); ++k) {
    if (times[k] != times[k - 1]) steps.push_back(std::abs(times[k] - times[k - 1]));
  }
  if (steps.empty()) return found;
  const double step = numeric::median(steps);
  // The median is used, because a clock that was set later has other numbers at first.
  const double at = numeric::median(times);
  const TimeForm named = time_unit_of(name);
  const TimeForm epoch = since_1970(at);
  if (named == TimeForm::minutes || named == TimeForm::hours) {
    found.form = named;
  } else if (named != TimeForm::automatic) {
    found.form = epoch != TimeForm::automatic && counted_from_start(epoch) == named ? epoch : named;
  } else if (at > 25569.0 && at < 73051.0 && step < 0.5 && whole_seconds(step * 86400.0) &&
             !whole_seconds(step * 10.0)) {
    found.form = TimeForm::excel;
  } else {
    found.form = epoch == TimeForm::automatic ? TimeForm::seconds : epoch;
    if (found.form == TimeForm::seconds || found.form == TimeForm::epoch_s)
      found.question = unit_question(times, steps, step);
    if (found.form == TimeForm::seconds) found.hint = other_time_units(step);
  }
  return found;
}

// Finds steps of 1/60 of a minute: whole seconds that are no usual sample rate.
std::string other_time_units(double step_s) {
  if (step_s >= 0.5 || !whole_seconds(step_s * 60.0) || whole_seconds(step_s * 200.0)) return {};
  return fmt::format("a step of {:.6g} s looks like {:.4g} s in minutes: --time minutes if it is",
                     step_s, step_s * 60.0);
}

}  // namespace loopwarden::record
