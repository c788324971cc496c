// SPDX-License-Identifier: Apache-2.0
#include "config/alarms_reader.hpp"

#include <fmt/format.h>

#include <optional>
#include <string>

#include "model/alarm/limits.hpp"

namespace loopwarden::config {
namespace {

using alarm::AlarmKind;
using alarm::Priority;

constexpr auto kNormalModes =
    std::to_array<Choice<alarm::NormalMode>>({{"automatic", alarm::NormalMode::automatic},
                                              {"manual", alarm::NormalMode::manual},
                                              {"any", alarm::NormalMode::any}});
constexpr auto kPriorities = std::to_array<Choice<Priority>>({{"low", Priority::low},
                                                              {"medium", Priority::medium},
                                                              {"high", Priority::high},
                                                              {"critical", Priority::critical}});

// A large deviation is reported sooner than a small one.
constexpr double kFarDelay_s = 2.0;
// Default dead bands.
constexpr double kBandOfSpan = 0.01;
constexpr double kBandOfLimit = 0.1;
constexpr double kTimeConstants = 3.0;

class Reader {
 public:
  explicit Reader(const AlarmsContext& context) : context_(context) {}

  LoopAlarmConfig read(std::optional<MapReader> in) {
    alarm::NormalMode& normal = alarms_.process.normal_mode;
    alarms_.watched = context_.watched;
    if (context_.watched) normal = alarm::NormalMode::any;
    process(AlarmKind::enable_open).fitted = context_.has_enable;
    process(AlarmKind::source_lost).fitted = context_.watched;
    process(AlarmKind::deviation).on_delay_s = alarm::AlarmLimits::kDeviationDelay_s;
    process(AlarmKind::pv_high_high).on_delay_s = kFarDelay_s;
    process(AlarmKind::pv_low_low).on_delay_s = kFarDelay_s;
    if (!in) return alarms_;
    in->set_one_of("normal_mode", kNormalModes,
                   "normal mode; after 10 s in another mode the alarm not_normal_mode is raised, "
                   "also in fallback and in manual after it. In manual after the start it is "
                   "raised only after the loop has been in automatic. any: never raised",
                   normal);
    if (in->describing()) {
      describe(*in);
    } else {
      read_each(*in);
    }
    check_order(*in);
    return alarms_;
  }

 private:
  alarm::ProcessRule& process(AlarmKind kind) { return alarms_.process.at(kind); }

  static bool has_limit(AlarmKind kind) { return kind >= AlarmKind::deviation; }

  void read_each(MapReader& in) {
    for (const AlarmKind kind : alarm::kAlarmKinds) {
      in.maybe_section(to_text(kind), "", [&](MapReader& alarm) {
        read_common(alarm, kind);
        if (has_limit(kind)) read_limit(alarm, kind);
        if (alarm::is_process_alarm(kind) && !process(kind).fitted) {
          in.warning(to_text(kind), kind == AlarmKind::enable_open
                                        ? "the loop has no such alarm: io has no enable contact"
                                        : "the loop has no such alarm: it is controlled here");
        }
      });
    }
  }

  // The keys that all alarms share appear once in the reference.
  void describe(MapReader& in) {
    in.maybe_section("ALARM",
                     "an alarm by its name, such as bad_pv or pv_high: docs/reference/alarms.md",
                     [&](MapReader& alarm) { read_common(alarm, AlarmKind::bad_pv); });
    for (const AlarmKind kind : alarm::kLimitAlarms) {
      in.maybe_section(to_text(kind), "off if absent",
                       [&](MapReader& alarm) { read_limit(alarm, kind); });
    }
  }

  void read_common(MapReader& in, AlarmKind kind) {
    const std::size_t at = alarm::index_of(kind);
    in.set_one_of("priority", kPriorities, "urgency of the operator's action", alarms_.priority[at],
                  {.fallback = in.describing() ? "docs/reference/alarms.md" : ""});
    if (alarm::is_process_alarm(kind)) {
      alarm::ProcessRule& rule = process(kind);
      constexpr Interval kDelays = between(0.0, 3600.0);
      in.set_number("on_delay",
                    {"s", kDelays,
                     "duration of the condition before the alarm is raised; not for valve alarms",
                     in.describing() ? "10; deviation 60, pv_high_high and pv_low_low 2" : ""},
                    rule.on_delay_s);
      in.set_number(
          "off_delay",
          {"s", kDelays,
           "duration without the condition before the alarm clears; not for valve alarms"},
          rule.off_delay_s);
    }
    AlarmTexts& texts = alarms_.texts[at];
    const auto text = [&](const char* key, const char* meaning, std::string& value) {
      const Value<std::string> said = in.text(key, meaning, "docs/reference/alarms.md");
      if (said.given && said.valid) value = said;
    };
    text("cause", "possible causes, for people", texts.cause);
    text("consequence", "of inaction", texts.consequence);
    text("action", "what to do", texts.action);
    text("time_to_act", "time for the action", texts.time_to_act);
  }

  void read_limit(MapReader& in, AlarmKind kind) {
    alarm::Limit& limit = alarms_.process.limits.at(kind);
    process(kind).fitted = true;
    const bool rate = kind == AlarmKind::rate_of_change;
    const bool of_range = kind != AlarmKind::deviation && !rate;
    const char* unit = rate ? "PV units/s" : "PV units";
    const Value<double> at =
        in.need_number("limit", {unit, of_range ? any_number() : above(0.0), meaning_of(kind)});
    limit.limit = at;
    if (of_range) require_in_range(in, at);
    const double usual = of_range ? kBandOfSpan * span() : kBandOfLimit * limit.limit;
    limit.dead_band =
        in.number("dead_band",
                  {unit, at_least(0.0), "distance inside the limit at which the alarm clears",
                   of_range ? "1 % of PV's span" : "a tenth of limit"},
                  usual);
    if (!of_range && at.valid && limit.dead_band >= limit.limit && at.given) {
      in.error("dead_band", fmt::format("must be less than limit = {} (got {})", brief(at),
                                        brief(limit.dead_band)));
    }
    if (kind == AlarmKind::deviation) read_deviation(in);
    if (rate) {
      in.set_number("over", {"s", above(0.0), "time constant of the filter for the slope"},
                    alarms_.process.limits.rate_time_s);
    }
  }

  void read_deviation(MapReader& in) {
    const Value<double> time_constant =
        in.need_number("time_constant", {"s", above(0.0),
                                         "of the closed loop; the alarm is suppressed for three "
                                         "time constants after a move of SP and after manual"});
    alarms_.process.limits.settle_s = kTimeConstants * time_constant;
    if (!in.describing() && !context_.knows_set_point) {
      in.error("limit", "needs a set point: io has no set_point");
    }
  }

  static const char* meaning_of(AlarmKind kind) {
    switch (kind) {
      case AlarmKind::deviation: return "how far PV may be from SP in automatic";
      case AlarmKind::rate_of_change: return "PV changes faster, up or down";
      case AlarmKind::pv_high_high:
      case AlarmKind::pv_high: return "PV above it";
      default: return "PV below it";
    }
  }

  double span() const {
    return context_.pv_range.valid ? context_.pv_range.value.second - context_.pv_range.value.first
                                   : 0.0;
  }

  void require_in_range(MapReader& in, const Value<double>& at) {
    const auto& range = context_.pv_range;
    if (!at.given || !at.valid || !range.given || !range.valid) return;
    if (at > range.value.first && at < range.value.second) return;
    in.error("limit", fmt::format("must lie inside the range of PV, [{}, {}] (at {}) (got {})",
                                  brief(range.value.first), brief(range.value.second),
                                  to_text(range.place), brief(at)));
  }

  // Checks low-low < low < high < high-high, each with its dead band.
  void check_order(MapReader& in) {
    if (in.describing()) return;
    constexpr std::array kRising{AlarmKind::pv_low_low, AlarmKind::pv_low, AlarmKind::pv_high,
                                 AlarmKind::pv_high_high};
    std::optional<AlarmKind> below;
    for (const AlarmKind kind : kRising) {
      if (!process(kind).fitted) continue;
      if (below) check_pair(in, *below, kind);
      below = kind;
    }
  }

  void check_pair(MapReader& in, AlarmKind lower, AlarmKind upper) {
    const alarm::Limit& low = alarms_.process.limits.at(lower);
    const alarm::Limit& high = alarms_.process.limits.at(upper);
    if (low.limit >= high.limit) {
      in.error(to_text(upper), fmt::format("its limit must be above that of {}, {} (got {})",
                                           to_text(lower), brief(low.limit), brief(high.limit)));
    } else if (lower == AlarmKind::pv_low && upper == AlarmKind::pv_high &&
               low.limit + low.dead_band >= high.limit - high.dead_band) {
      in.error(to_text(upper),
               "its dead band and that of pv_low leave no normal range. Reduce a dead band");
    }
  }

  const AlarmsContext& context_;
  LoopAlarmConfig alarms_;
};

}  // namespace

LoopAlarmConfig read_loop_alarms(std::optional<MapReader> in, const AlarmsContext& context) {
  return Reader(context).read(std::move(in));
}

}  // namespace loopwarden::config
