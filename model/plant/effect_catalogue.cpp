// SPDX-License-Identifier: Apache-2.0
#include "model/plant/effect_catalogue.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace loopwarden::plant {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLongestDeadTime = 1e6;  // samples

constexpr ParameterInfo at_least_zero(const char* name, const char* unit, const char* meaning) {
  return {name, unit, 0.0, false, kInfinity, true, true, 0.0, meaning};
}
constexpr ParameterInfo above_zero(const char* name, const char* unit, const char* meaning) {
  return {name, unit, 0.0, true, kInfinity, true, true, 0.0, meaning};
}
constexpr ParameterInfo any_value(const char* name, const char* unit, const char* meaning) {
  return {name, unit, -kInfinity, true, kInfinity, true, true, 0.0, meaning};
}
constexpr ParameterInfo optional(ParameterInfo info, double fallback) {
  info.required = false;
  info.fallback = fallback;
  return info;
}

constexpr std::array kValve{Block::valve};
constexpr std::array kProcess{Block::process};
constexpr std::array kTransmitter{Block::transmitter};
constexpr std::array kDisturbance{Block::disturbance};
constexpr std::array kProcessOrTransmitter{Block::process, Block::transmitter};

constexpr std::array kStiction{
    at_least_zero("s", "CO units", "deadband + stickband"),
    at_least_zero("j", "CO units", "slip jump, at most s"),
    optional(above_zero("natural_frequency", "rad/s", "of the actuator, law inertial"), 20.0),
    optional(ParameterInfo{"damping", "-", 0.0, true, 20.0, false, true, 0.0,
                           "ratio, of the actuator, law inertial"},
             0.7)};
constexpr std::array kStictionLaws{"choudhury", "he", "karnopp", "inertial"};
constexpr std::array kStictionOptions{OptionInfo{
    "law", kStictionLaws, "data-driven (choudhury, he) or physical (karnopp, inertial)"}};

constexpr std::array kBacklash{
    at_least_zero("deadband", "CO units", "all that CO loses on a reversal")};

constexpr std::array kHysteresis{
    optional(any_value("offset", "CO units", "added while the output falls"), 0.0),
    optional(at_least_zero("width", "CO units", "distance between the branches of a gradual loop"),
             0.0),
    optional({"knee", "-", -4.0, false, 1.0, false, true, 0.0,
              "with width: how sharply the new branch begins; 1 is backlash"},
             0.0)};

constexpr std::array kLowAir{
    above_zero("rate", "CO units/s", "fill rate"),
    optional(any_value("travel_limit", "CO units", "where the spring balances the supply"),
             kInfinity),
    optional(at_least_zero("lag", "s", "time constant of the actuator volume"), 0.0),
    optional(at_least_zero("preload", "CO units", "what the spring takes before the stem moves"),
             0.0)};
constexpr std::array kFilling{"both_ways", "one_sided"};
constexpr std::array kLowAirOptions{
    OptionInfo{"filling", kFilling, "one_sided: only the opening is limited"}};

constexpr std::array kCharacteristic{
    optional({"rangeability", "-", 1.0, true, 1e6, false, true, 0.0, "of equal_percentage"}, 30.0)};
constexpr std::array kCurves{"linear", "equal_percentage", "quick_opening", "butterfly", "table"};
constexpr std::array kCharacteristicOptions{
    OptionInfo{"curve", kCurves, "inherent characteristic"}};

constexpr std::array kCam{
    any_value("position", "CO units", "where on the travel"),
    above_zero("band", "CO units", "CO that it takes to pass"),
    at_least_zero("jump", "CO units", "how far the stem then jumps, at most band")};

constexpr std::array kPositioner{
    at_least_zero("dead_band", "CO units", "what CO loses on a reversal"),
    above_zero("gain", "1/s", "of the relay"), above_zero("lag", "s", "of the actuator's volume"),
    optional(at_least_zero("breakaway", "CO units", "what opens a shut valve"), 0.0)};

constexpr std::array kOvershoot{
    ParameterInfo{"damping", "-", 0.0, true, 1.0, true, true, 0.0, "damping ratio"},
    above_zero("natural_frequency", "rad/s", "undamped")};

constexpr std::array kGain{above_zero("factor", "-", "1: no change")};
constexpr std::array kDeadTime{at_least_zero("seconds", "s", "on top of the process's own")};
constexpr std::array kLag{at_least_zero("time_constant", "s", "of the first-order lag")};
constexpr std::array kBias{any_value("bias", "PV units", "added to PV")};
constexpr std::array kDrift{any_value("rate", "PV units/s", "from the start of the record")};
constexpr std::array kSine{at_least_zero("amplitude", "PV units", "of the sine"),
                           above_zero("period", "s", "of the sine"),
                           optional(any_value("phase", "rad", "at the start of the record"), 0.0)};
constexpr std::array kStep{any_value("size", "PV units", "of the step"),
                           any_value("time", "s", "when it begins")};
constexpr std::array kLoad{
    at_least_zero("intensity", "PV units/sqrt(s)", "of the random walk"),
    optional(above_zero("time_constant", "s", "with which it returns to zero"), 300.0)};

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", value);
  return text.data();
}

std::string range_text(const ParameterInfo& p) {
  std::string text;
  if (p.low > -kInfinity) text = (p.low_is_open ? "> " : ">= ") + number(p.low);
  if (p.high < kInfinity) {
    text +=
        (text.empty() ? "" : " and ") + std::string(p.high_is_open ? "< " : "<= ") + number(p.high);
  }
  return text.empty() ? "a finite number" : text;
}

void check_parameter(const ParameterInfo& info, double value) {
  const bool low_ok = info.low_is_open ? value > info.low : value >= info.low;
  const bool high_ok = info.high_is_open ? value < info.high : value <= info.high;
  if (std::isfinite(value) && low_ok && high_ok) return;
  throw EffectError(info.name, std::string(info.name) + " must be " + range_text(info) + " " +
                                   info.unit + " (got " + number(value) + ")");
}

const ParameterInfo* find_parameter(const EffectInfo& info, std::string_view name) {
  for (const ParameterInfo& p : info.parameters) {
    if (p.name == name) return &p;
  }
  return nullptr;
}

const OptionInfo* find_option(const EffectInfo& info, std::string_view name) {
  for (const OptionInfo& o : info.options) {
    if (o.name == name) return &o;
  }
  return nullptr;
}

// Reads a spec against its description, which is there.
class SpecReader {
 public:
  explicit SpecReader(const EffectSpec& spec) : info_(*find_effect(spec.name)), spec_(spec) {}

  double value(const char* name) const {
    const auto it = spec_.parameters.find(name);
    if (it != spec_.parameters.end()) return it->second;
    const ParameterInfo* parameter = find_parameter(info_, name);
    if (parameter == nullptr) throw std::logic_error(std::string("no parameter ") + name);
    return parameter->fallback;
  }
  bool has(const char* name) const { return spec_.parameters.contains(name); }
  std::string_view option(const char* name) const {
    const auto it = spec_.options.find(name);
    return it != spec_.options.end() ? std::string_view(it->second)
                                     : find_option(info_, name)->values.front();
  }

 private:
  const EffectInfo& info_;
  const EffectSpec& spec_;
};

void check_table(const EffectSpec& spec, std::string_view curve) {
  if (curve != "table") {
    if (!spec.table.empty()) throw EffectError("table", "a table needs no named curve beside it");
    return;
  }
  if (spec.table.size() < 2 || spec.table.size() > ValveCharacteristic::kMostPoints) {
    throw EffectError("table", "table must have 2 to " +
                                   std::to_string(ValveCharacteristic::kMostPoints) +
                                   " points (got " + std::to_string(spec.table.size()) + ")");
  }
  for (std::size_t i = 0; i < spec.table.size(); ++i) {
    const auto& [x, q] = spec.table[i];
    if (!std::isfinite(x) || !std::isfinite(q)) {
      throw EffectError("table", "table holds a number that is not finite");
    }
    if (i > 0 && (x <= spec.table[i - 1].first || q <= spec.table[i - 1].second)) {
      throw EffectError(
          "table", "table must rise in both columns (see point " + std::to_string(i + 1) + ")");
    }
  }
}

void check_relations(const EffectSpec& spec, const EffectContext& context) {
  const SpecReader read(spec);
  const std::string_view name = spec.name;
  if (name == "stiction" && read.value("j") > read.value("s")) {
    throw EffectError("j", "j must be at most s = " + number(read.value("s")) + " CO units (got " +
                               number(read.value("j")) + ")");
  }
  if (name == "stiction") {
    const bool inertial = read.option("law") == "inertial";
    for (const char* key : {"natural_frequency", "damping"}) {
      if (!inertial && read.has(key)) {
        throw EffectError(key, std::string(key) + " belongs to law inertial");
      }
    }
    if (inertial && !(read.value("natural_frequency") * context.sample_time_s < kPi)) {
      throw EffectError("natural_frequency", "natural_frequency must be below " +
                                                 number(kPi / context.sample_time_s) +
                                                 " rad/s, half the sampling rate (got " +
                                                 number(read.value("natural_frequency")) + ")");
    }
  }
  if (name == "cam_obstruction" && read.value("jump") > read.value("band")) {
    throw EffectError("jump", "jump must be at most band = " + number(read.value("band")) +
                                  " CO units (got " + number(read.value("jump")) + ")");
  }
  if (name == "hysteresis" && read.has("offset") == read.has("width")) {
    throw EffectError("", "hysteresis takes either offset or width");
  }
  if (name == "hysteresis" && read.has("knee") && !read.has("width")) {
    throw EffectError("knee", "knee belongs to width");
  }
  if (name == "extra_dead_time" &&
      read.value("seconds") > kLongestDeadTime * context.sample_time_s) {
    throw EffectError("seconds", "seconds must be at most " +
                                     number(kLongestDeadTime * context.sample_time_s) + " s");
  }
  const bool has_curve = name == "valve_characteristic";
  if (has_curve) check_table(spec, read.option("curve"));
  if (!has_curve && !spec.table.empty()) {
    throw EffectError("table", "effect '" + spec.name + "' takes no table");
  }
}

ValveCharacteristic::Parameters characteristic(const SpecReader& read, const EffectSpec& spec) {
  ValveCharacteristic::Parameters p;
  const std::string_view curve = read.option("curve");
  for (std::size_t i = 0; i < kCurves.size(); ++i) {
    if (curve == kCurves[i]) p.curve = static_cast<ValveCharacteristic::Curve>(i);
  }
  p.rangeability = read.value("rangeability");
  p.point_count = spec.table.size();
  std::copy(spec.table.begin(), spec.table.end(), p.points.begin());
  return p;
}

// How each is made, from a spec that passed check_effect().
Effect make_stiction(const EffectSpec& spec, const EffectContext& context) {
  const SpecReader read(spec);
  const StictionParameters p{read.value("s"), read.value("j")};
  const std::string_view law = read.option("law");
  if (law == "he") return StictionHe(p);
  if (law == "karnopp") return StictionKarnopp(p, context.sample_time_s);
  if (law == "inertial") {
    return StictionInertial(p, {read.value("natural_frequency"), read.value("damping")},
                            context.sample_time_s);
  }
  return StictionChoudhury(p);
}

Effect make_backlash(const EffectSpec& spec, const EffectContext& /*context*/) {
  return Backlash(SpecReader(spec).value("deadband"));
}

Effect make_hysteresis(const EffectSpec& spec, const EffectContext& /*context*/) {
  const SpecReader read(spec);
  if (read.has("width")) return HysteresisWidth(read.value("width"), read.value("knee"));
  return HysteresisOffset(read.value("offset"));
}

Effect make_low_air_supply(const EffectSpec& spec, const EffectContext& context) {
  const SpecReader read(spec);
  const bool one_sided = read.option("filling") == "one_sided";
  return LowAirSupply(
      {.rate = read.value("rate"),
       .travel_limit = read.value("travel_limit"),
       .lag_s = read.value("lag"),
       .filling = one_sided ? LowAirSupply::Filling::one_sided : LowAirSupply::Filling::both_ways,
       .preload = read.value("preload"),
       .shut = context.output_low},
      context.sample_time_s);
}

Effect make_valve_characteristic(const EffectSpec& spec, const EffectContext& context) {
  return ValveCharacteristic(characteristic(SpecReader(spec), spec), context.output_low,
                             context.output_high);
}

Effect make_cam_obstruction(const EffectSpec& spec, const EffectContext& /*context*/) {
  const SpecReader read(spec);
  return CamObstruction(read.value("position"), read.value("band"), read.value("jump"));
}

Effect make_positioner(const EffectSpec& spec, const EffectContext& context) {
  const SpecReader read(spec);
  return Positioner({.dead_band = read.value("dead_band"),
                     .gain_per_s = read.value("gain"),
                     .lag_s = read.value("lag"),
                     .breakaway = read.value("breakaway")},
                    context.output_low, context.output_high, context.sample_time_s);
}

Effect make_positioner_overshoot(const EffectSpec& spec, const EffectContext& context) {
  const SpecReader read(spec);
  return PositionerOvershoot(read.value("damping"), read.value("natural_frequency"),
                             context.sample_time_s);
}

Effect make_lag(const EffectSpec& spec, const EffectContext& context) {
  return FirstOrderLag(SpecReader(spec).value("time_constant"), context.sample_time_s);
}

Effect make_gain_change(const EffectSpec& spec, const EffectContext& /*context*/) {
  return GainChange(SpecReader(spec).value("factor"));
}

Effect make_extra_dead_time(const EffectSpec& spec, const EffectContext& context) {
  return ExtraDeadTime(SpecReader(spec).value("seconds"), context.sample_time_s);
}

Effect make_output_bias(const EffectSpec& spec, const EffectContext& /*context*/) {
  return OutputBias(SpecReader(spec).value("bias"));
}

Effect make_drift(const EffectSpec& spec, const EffectContext& /*context*/) {
  return Drift(SpecReader(spec).value("rate"));
}

Effect make_oscillating_disturbance(const EffectSpec& spec, const EffectContext& /*context*/) {
  const SpecReader read(spec);
  return OscillatingDisturbance(read.value("amplitude"), read.value("period"), read.value("phase"));
}

Effect make_step_disturbance(const EffectSpec& spec, const EffectContext& /*context*/) {
  const SpecReader read(spec);
  return StepDisturbance(read.value("size"), read.value("time"));
}

Effect make_random_load(const EffectSpec& spec, const EffectContext& context) {
  const SpecReader read(spec);
  return RandomLoad(read.value("intensity"), read.value("time_constant"), context.sample_time_s,
                    context.seed);
}

constexpr std::array kCatalogue{
    EffectInfo{"stiction", kValve, kStiction, kStictionOptions, "stiction_choudhury.hpp",
               "the stem sticks, then jumps"},
    EffectInfo{"backlash",
               kValve,
               kBacklash,
               {},
               "backlash.hpp",
               "play between stem and plug: lost motion on every reversal"},
    EffectInfo{"hysteresis",
               kValve,
               kHysteresis,
               {},
               "hysteresis_width.hpp",
               "another branch on the way down than on the way up"},
    EffectInfo{"low_air_supply", kValve, kLowAir, kLowAirOptions, "low_air_supply.hpp",
               "the actuator fills slowly and not all the way"},
    EffectInfo{"valve_characteristic", kValve, kCharacteristic, kCharacteristicOptions,
               "valve_characteristic.hpp", "flow is not proportional to stem travel"},
    EffectInfo{"cam_obstruction",
               kValve,
               kCam,
               {},
               "cam_obstruction.hpp",
               "the stem sticks and jumps at one place of its travel"},
    EffectInfo{"positioner",
               kValve,
               kPositioner,
               {},
               "positioner.hpp",
               "the positioner has a dead band, overshoots large steps, and sticks when shut"},
    EffectInfo{"positioner_overshoot",
               kValve,
               kOvershoot,
               {},
               "positioner_overshoot.hpp",
               "the positioner overshoots and rings"},
    EffectInfo{"positioner_lag",
               kValve,
               kLag,
               {},
               "first_order_lag.hpp",
               "the stem follows CO with a first-order lag"},
    EffectInfo{"gain_change",
               kProcess,
               kGain,
               {},
               "gain_change.hpp",
               "the process gain is another than believed"},
    EffectInfo{"extra_dead_time",
               kProcess,
               kDeadTime,
               {},
               "extra_dead_time.hpp",
               "more dead time than believed"},
    EffectInfo{"extra_lag",
               kProcessOrTransmitter,
               kLag,
               {},
               "first_order_lag.hpp",
               "one more lag than believed"},
    EffectInfo{
        "output_bias", kTransmitter, kBias, {}, "output_bias.hpp", "PV is off by a constant"},
    EffectInfo{"drift", kTransmitter, kDrift, {}, "drift.hpp", "PV drifts off steadily"},
    EffectInfo{"oscillating_disturbance",
               kDisturbance,
               kSine,
               {},
               "oscillating_disturbance.hpp",
               "another loop swings this one"},
    EffectInfo{"step_disturbance",
               kDisturbance,
               kStep,
               {},
               "step_disturbance.hpp",
               "a load comes on at one moment"},
    EffectInfo{
        "random_load", kDisturbance, kLoad, {}, "random_load.hpp", "an unmeasured load wanders"},
};
// In the order of the catalogue: a row without its maker does not compile.
struct Maker {
  std::string_view name;
  Effect (*make)(const EffectSpec& spec, const EffectContext& context);
};
constexpr std::array kMakers{
    Maker{"stiction", make_stiction},
    Maker{"backlash", make_backlash},
    Maker{"hysteresis", make_hysteresis},
    Maker{"low_air_supply", make_low_air_supply},
    Maker{"valve_characteristic", make_valve_characteristic},
    Maker{"cam_obstruction", make_cam_obstruction},
    Maker{"positioner", make_positioner},
    Maker{"positioner_overshoot", make_positioner_overshoot},
    Maker{"positioner_lag", make_lag},
    Maker{"gain_change", make_gain_change},
    Maker{"extra_dead_time", make_extra_dead_time},
    Maker{"extra_lag", make_lag},
    Maker{"output_bias", make_output_bias},
    Maker{"drift", make_drift},
    Maker{"oscillating_disturbance", make_oscillating_disturbance},
    Maker{"step_disturbance", make_step_disturbance},
    Maker{"random_load", make_random_load},
};
constexpr bool every_effect_has_its_maker() {
  return std::equal(kCatalogue.begin(), kCatalogue.end(), kMakers.begin(), kMakers.end(),
                    [](const EffectInfo& info, const Maker& maker) {
                      return info.name == maker.name && maker.make != nullptr;
                    });
}
static_assert(every_effect_has_its_maker());

}  // namespace

const char* to_text(Block block) noexcept {
  switch (block) {
    case Block::controller: return "controller";
    case Block::valve: return "valve";
    case Block::process: return "process";
    case Block::transmitter: return "transmitter";
    case Block::disturbance: break;
  }
  return "disturbance";
}

std::span<const EffectInfo> effect_catalogue() noexcept { return kCatalogue; }

const EffectInfo* find_effect(std::string_view name) noexcept {
  for (const EffectInfo& info : kCatalogue) {
    if (info.name == name) return &info;
  }
  return nullptr;
}

void check_effect(const EffectSpec& spec, Block block, const EffectContext& context) {
  const EffectInfo* info = find_effect(spec.name);
  if (info == nullptr) throw EffectError("effect", "unknown effect '" + spec.name + "'");
  if (std::find(info->blocks.begin(), info->blocks.end(), block) == info->blocks.end()) {
    throw EffectError("effect", "effect '" + spec.name + "' belongs to the " +
                                    to_text(info->blocks.front()) + ", not to the " +
                                    to_text(block));
  }
  for (const auto& [name, value] : spec.parameters) {
    const ParameterInfo* parameter = find_parameter(*info, name);
    if (parameter == nullptr) {
      throw EffectError(name, "effect '" + spec.name + "' has no parameter '" + name + "'");
    }
    check_parameter(*parameter, value);
  }
  for (const auto& [name, value] : spec.options) {
    const OptionInfo* option = find_option(*info, name);
    if (option == nullptr) {
      throw EffectError(name, "effect '" + spec.name + "' has no option '" + name + "'");
    }
    if (std::find(option->values.begin(), option->values.end(), value) == option->values.end()) {
      std::string allowed;
      for (const char* v : option->values) {
        if (!allowed.empty()) allowed += ", ";
        allowed += v;
      }
      throw EffectError(name, std::string(name)
                                  .append(" must be one of ")
                                  .append(allowed)
                                  .append(" (got '")
                                  .append(value)
                                  .append("')"));
    }
  }
  for (const ParameterInfo& parameter : info->parameters) {
    if (parameter.required && !spec.parameters.contains(parameter.name)) {
      throw EffectError("", "effect '" + spec.name + "' needs " + parameter.name + " (" +
                                parameter.unit + ": " + parameter.meaning + ")");
    }
  }
  check_relations(spec, context);
}

Effect make_effect(const EffectSpec& spec, const EffectContext& context) {
  const EffectInfo* info = find_effect(spec.name);
  if (info == nullptr) throw EffectError("effect", "unknown effect '" + spec.name + "'");
  return kMakers[static_cast<std::size_t>(info - kCatalogue.data())].make(spec, context);
}

}  // namespace loopwarden::plant
