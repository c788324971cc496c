// SPDX-License-Identifier: Apache-2.0
#include "config/controller_reader.hpp"

#include <fmt/format.h>

#include <initializer_list>
#include <string>
#include <tuple>
#include <utility>

#include "config/loop_model_writer.hpp"

namespace loopwarden::config {
namespace {

constexpr auto kAntiWindups = std::to_array<Choice<control::AntiWindup>>(
    {{"integral_clamp", control::AntiWindup::integral_clamp},
     {"back_calculation", control::AntiWindup::back_calculation},
     {"conditional", control::AntiWindup::conditional}});

constexpr auto kJacketForms =
    std::to_array<Choice<control::JacketForm>>({{"off", control::JacketForm::off},
                                                {"paper", control::JacketForm::paper},
                                                {"bounded", control::JacketForm::bounded},
                                                {"dwell", control::JacketForm::dwell}});

constexpr auto kCompensators = std::to_array<Choice<control::CompensatorKind>>(
    {{"none", control::CompensatorKind::none},
     {"knocker", control::CompensatorKind::knocker},
     {"two_move", control::CompensatorKind::two_move},
     {"reinforcement", control::CompensatorKind::reinforcement},
     {"backlash", control::CompensatorKind::backlash},
     {"hysteresis", control::CompensatorKind::hysteresis},
     {"planned_moves", control::CompensatorKind::planned_moves}});

constexpr const char* kForms = "kp and ki, or kc and ti";

const Value<double>* first_given(std::initializer_list<const Value<double>*> values) {
  for (const Value<double>* value : values) {
    if (value->given) return value;
  }
  return nullptr;
}

void refuse_both(MapReader& in, const Value<double>& a, const char* a_name, const Value<double>& b,
                 const char* b_name) {
  if (!a.given || !b.given) return;
  in.error(b_name,
           fmt::format("conflicts with {} (at {}); give one of them", a_name, to_text(a.place)));
}

}  // namespace

control::PidGains read_gains(MapReader& in, std::optional<double> pv_span,
                             std::optional<double> co_span) {
  const Value<double> kp = in.maybe_number(
      "kp", {"CO units/PV unit", at_least(0.0), "proportional gain, parallel form", kForms});
  const Value<double> ki =
      in.maybe_number("ki", {"CO units/(PV unit s)", at_least(0.0),
                             "integral gain, parallel form; 0: no integral action", "with kp"});
  const Value<double> kd = in.maybe_number(
      "kd",
      {"CO units s/PV unit", at_least(0.0), "derivative gain, parallel form; acts on PV", "0"});
  const Value<double> kc = in.maybe_number(
      "kc", {"% of CO span/% of PV span", above(0.0), "gain, ISA standard form", kForms});
  const Value<double> pb =
      in.maybe_number("pb", {"%", above(0.0), "proportional band, 100 / kc", "instead of kc"});
  const Value<double> ti =
      in.maybe_number("ti", {"s", above(0.0), "integral time, seconds per repeat", "with kc"});
  const Value<double> ti_min = in.maybe_number(
      "ti_min", {"min", above(0.0), "integral time, minutes per repeat", "instead of ti"});
  const Value<double> td =
      in.maybe_number("td", {"s", at_least(0.0), "derivative time, ISA standard form", "0"});
  const Value<double> filter =
      in.number("derivative_filter",
                {"s", at_least(0.0), "time constant of the filter on the derivative"}, 0.0);
  if (in.describing()) return {};

  const Value<double>* parallel = first_given({&kp, &ki, &kd});
  const Value<double>* isa = first_given({&kc, &pb, &ti, &ti_min, &td});
  control::PidGains gains{.kp = kp, .ki = ki, .kd = kd, .derivative_filter_s = filter};
  if (parallel != nullptr && isa != nullptr) {
    in.report().error(isa->place, isa->key,
                      fmt::format("belongs to the ISA form, but {} (at {}) to the parallel form. "
                                  "Use one form",
                                  parallel->key, to_text(parallel->place)));
    return gains;
  }
  if (isa == nullptr) {
    if (!kp.given && !ki.given) {
      in.error(fmt::format("gains are missing: {}", kForms));
    } else if (!kp.given || !ki.given) {
      in.error(
          fmt::format("missing key '{}' (the parallel form needs kp and ki; 0 switches a term off)",
                      kp.given ? "ki" : "kp"));
    } else if (kp.valid && ki.valid && kp == 0.0 && ki == 0.0) {
      in.error("kp", fmt::format("kp and ki (at {}) are both 0: the output would never move",
                                 to_text(ki.place)));
    }
    return gains;
  }
  refuse_both(in, kc, "kc", pb, "pb");
  refuse_both(in, ti, "ti", ti_min, "ti_min");
  if (!kc.given && !pb.given) in.error("missing key 'kc' (or pb; the ISA form needs a gain)");
  if (!ti.given && !ti_min.given) {
    in.error(
        "missing key 'ti' (s per repeat, or ti_min; without integral action use kp and ki: 0)");
  }
  const bool complete = (kc.given || pb.given) && (ti.given || ti_min.given) && kc.valid &&
                        pb.valid && ti.valid && ti_min.valid && td.valid && filter.valid;
  if (!complete || !pv_span || !co_span) return gains;
  return control::from_isa({.kc = kc.given ? kc.value : 100.0 / pb.value,
                            .ti_s = ti.given ? ti.value : 60.0 * ti_min.value,
                            .td_s = td,
                            .derivative_filter_s = filter},
                           *pv_span, *co_span);
}

void read_anti_windup(MapReader& in, control::AntiWindup fallback, control::PidSettings& pid) {
  pid.anti_windup = in.one_of("anti_windup", kAntiWindups,
                              "method against windup of the integral at a limit", fallback);
  pid.tracking_time_s = in.maybe_number(
      "tracking_time",
      {"s", above(0.0), "of back_calculation", "integral time; 1 s without integral action"});
}

control::JacketSettings read_jacket(MapReader& in) {
  control::JacketSettings jacket;
  in.set_one_of("form", kJacketForms,
                "law of the stickband jacket; paper acts in simulate and compare only",
                jacket.form);
  in.set_flag("shadow", "compute and record it, without acting", jacket.shadow);
  in.set_number("ks", {"1/s", at_least(0.0), "gain of the jacket"}, jacket.gain_per_s);
  in.set_number("dead_zone",
                {"CO units", at_least(0.0), "larger than the error of the valve position"},
                jacket.dead_zone);
  in.maybe_number("max_mean_error",
                  {"PV units", above(0.0), "mean error above which the jacket is suspended",
                   "none; required if the jacket acts on hardware"},
                  jacket.max_mean_error);
  in.set_number("mean_error_time", {"s", above(0.0), "time constant of that mean"},
                jacket.mean_error_time_s);
  return jacket;
}

// Reads s or j with its interval.
void read_stick_size(MapReader& in, const char* key, const char* meaning, double& value,
                     double& low, double& high) {
  const Value<double> size = in.need_number(key, {"CO units", above(0.0), meaning});
  value = low = high = size;
  const std::string interval_key = std::string(key) + "_interval";
  const Value<std::pair<double, double>> interval = in.maybe_range(
      interval_key, {"CO units", above(0.0), "interval of possible values", "only the value"});
  if (!interval.given || !interval.valid || !size.valid) return;
  std::tie(low, high) = interval.value;
  if (size < low || size > high) {
    in.error(interval_key, fmt::format("{} to {} does not hold {} = {}", brief(low), brief(high),
                                       key, brief(size)));
  }
}

control::PlannedMovesSettings read_planned_moves(MapReader& in) {
  control::PlannedMovesSettings m;
  in.need_section("process", "steady-state gain from stem to PV", [&](MapReader& process) {
    const Value<double> gain =
        process.need_number("gain", {"PV units/CO unit", any_number(), "not 0"});
    m.gain = gain;
    if (gain.given && gain.valid && gain == 0.0) process.error("gain", "must not be 0");
    m.time_constant_s = process.need_number("time_constant", {"s", at_least(0.0), "of the lag"});
    m.dead_time_s = process.need_number("dead_time", {"s", at_least(0.0), "dead time"});
  });
  in.set_number("actuator_lag",
                {"s", at_least(0.0), "of the actuator; 0: learnt if the stem is read back"},
                m.actuator_lag_s);
  m.load = in.need_number("load", {"PV units/sqrt(s)", at_least(0.0),
                                   "intensity of the load's random walk; 0: steady"});
  read_stick_size(in, "s", "stick band with dead band of the valve", m.s, m.s_low, m.s_high);
  read_stick_size(in, "j", "slip jump of the valve", m.j, m.j_low, m.j_high);
  if (m.j > m.s && m.s > 0.0)
    in.error("j", fmt::format("must not exceed s = {} (got {})", brief(m.s), brief(m.j)));
  in.maybe_number("max_move",
                  {"CO units", above(0.0),
                   "longest single move of the stem; a detour, for less than j, needs 1.15 j more",
                   "none; required on hardware"},
                  m.max_move);
  in.maybe_number(
      "max_moves_per_hour",
      {"1/h", above(0.0), "most moves in any hour; a detour is two", "none; required on hardware"},
      m.max_moves_per_hour);
  in.set_flag("read_back", "the stem is read back; false: taken from the law of stiction",
              m.read_back);
  return m;
}

void check_gain(MapReader& compensator, const control::CompensatorSettings& settings,
                control::Action action) {
  const double gain = settings.planned.gain;
  if (settings.kind != control::CompensatorKind::planned_moves || gain == 0.0) return;
  if (control::gain_fits(gain, action)) return;
  const bool reverse = action == control::Action::reverse;
  compensator.error("process",
                    fmt::format("gain {:g} contradicts controller.action {}: PV {} when "
                                "CO rises. Set a gain {} 0, or correct the action",
                                gain, reverse ? "reverse" : "direct", reverse ? "rises" : "falls",
                                reverse ? "above" : "below"));
}

control::CompensatorSettings read_compensator(MapReader& in) {
  using Kind = control::CompensatorKind;
  control::CompensatorSettings c;
  c.kind = in.need_one_of("kind", kCompensators,
                          "correction of CO against the valve's fault; knocker, two_move and "
                          "reinforcement act in simulate and compare only");
  in.set_flag("shadow", "compute and record it, without acting", c.shadow);
  in.maybe_number(
      "limit",
      {"CO units", above(0.0), "largest correction", "none; required if it acts on hardware"},
      c.limit);
  if (c.kind == Kind::planned_moves && in.given("limit"))
    in.error("limit", "does not apply to planned_moves. Use max_move");
  const auto chosen = [&](Kind kind) { return in.describing() || c.kind == kind; };
  const auto noise_band = [&](MapReader& keys) {
    c.noise_band = keys.number(
        "noise_band", {"CO units", at_least(0.0), "smaller reversals of CO are ignored"}, 0.0);
  };
  if (chosen(Kind::knocker)) {
    MapReader keys = in.variant("knocker");
    c.amplitude = keys.need_number("amplitude", {"CO units", above(0.0), "of the pulses"});
    const Value<double> period =
        keys.number("pulse_period", {"s", above(0.0), "from pulse to pulse"}, c.pulse_period_s);
    c.pulse_period_s = period;
    const Value<double> width =
        keys.number("pulse_width", {"s", above(0.0), "of a pulse"}, c.pulse_width_s);
    c.pulse_width_s = width;
    if (width.valid && period.valid && width.value >= period.value) {
      keys.error("pulse_width", fmt::format("must be below pulse_period = {} s (got {})",
                                            brief(period), brief(width)));
    }
  }
  if (chosen(Kind::two_move)) {
    MapReader keys = in.variant("two_move");
    c.stick_band = keys.need_number("stick_band", {"CO units", above(0.0), "of the valve"});
    keys.set_number("factor", {"", above(1.0), "size of the first move over the stick band"},
                    c.factor);
    keys.set_number("move_time", {"s", above(0.0), "of the first move"}, c.move_time_s);
    const Value<double> most = keys.need_number(
        "max_mean_error", {"PV units", above(0.0), "mean error above which it is suspended"});
    if (most.given) c.max_mean_error = most;
    keys.set_number("mean_error_time", {"s", above(0.0), "time constant of that mean"},
                    c.mean_error_time_s);
  }
  if (chosen(Kind::reinforcement)) {
    MapReader keys = in.variant("reinforcement");
    c.amplitude = keys.need_number(
        "amplitude", {"CO units", above(0.0), "added in the direction of CO's movement"});
    noise_band(keys);
  }
  if (chosen(Kind::backlash)) {
    MapReader keys = in.variant("backlash");
    c.gap = keys.need_number(
        "gap", {"CO units", above(0.0), "added at a reversal; at most the valve's dead band"});
    noise_band(keys);
  }
  if (chosen(Kind::hysteresis)) {
    MapReader keys = in.variant("hysteresis");
    const Value<double> width = keys.maybe_number(
        "width", {"CO units", above(0.0), "distance of the branches", "or offset"});
    const Value<double> offset = keys.maybe_number(
        "offset", {"CO units", above(0.0), "offset of the valve while CO falls", "or width"});
    keys.set_number(
        "knee", {"", between(-4.0, 1.0), "with width: sharpness of the start of a branch"}, c.knee);
    noise_band(keys);
    if (width.given) c.width = width;
    if (offset.given) c.offset = offset;
    if (!in.describing() && width.given == offset.given) {
      keys.error(width.given ? "offset conflicts with width; give one of them"
                             : "missing key 'width' (or 'offset')");
    }
  }
  if (chosen(Kind::planned_moves)) {
    MapReader keys = in.variant("planned_moves");
    c.planned = read_planned_moves(keys);
  }
  return c;
}

Value<double> read_sample_time(MapReader& in) {
  constexpr double kShortest = 0.001;  // s
  constexpr double kLongest = 3600.0;  // s
  return in.need_number("sample_time", {"s", between(kShortest, kLongest), "period of the loop"});
}

const char* to_text(control::AntiWindup anti_windup) { return name_of(kAntiWindups, anti_windup); }

const char* to_text(control::JacketForm form) { return name_of(kJacketForms, form); }

}  // namespace loopwarden::config
