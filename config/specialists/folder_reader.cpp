// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <set>

#include "base/digest/digest.hpp"
#include "config/document.hpp"
#include "config/map_reader.hpp"
#include "config/specialists/specialist_folder.hpp"
#include "config/specialists/weights_text.hpp"

namespace loopwarden::config {
namespace {

using specialist::Condition;
using specialist::NetworkShape;

constexpr std::size_t kMostBytesOfNumber = 24;
constexpr std::size_t kMostSpecialists = 64;
constexpr std::size_t kInputsOfVersion1 = 53;

enum class Form { explaining, signature };
constexpr auto kForms =
    std::to_array<Choice<Form>>({{"explaining", Form::explaining}, {"signature", Form::signature}});

// Parses "31-10-10-31"; nullopt if the text has another form.
std::optional<NetworkShape> parse_layers(std::string_view text) {
  std::array<std::size_t, 4> sizes{};
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), sizes[i]);
    if (error != std::errc() || sizes[i] == 0 || sizes[i] > kMostNeurons) return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    if (i + 1 < sizes.size()) {
      if (!text.starts_with('-')) return std::nullopt;
      text.remove_prefix(1);
    }
  }
  if (!text.empty()) return std::nullopt;
  return NetworkShape{sizes[0], sizes[1], sizes[2], sizes[3]};
}

// Returns whether a name is plain, so that it can't refer to a file outside the folder.
bool is_plain_name(std::string_view name) {
  return !name.empty() && name.size() <= 64 && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                  c == '-' || c == '_' || c == '.';
         });
}

class ManifestReader {
 public:
  ManifestReader(MapReader root, std::filesystem::path folder, std::vector<Diagnostic>& of_weights)
      : root_(std::move(root)), folder_(std::move(folder)), of_weights_(of_weights) {}

  SpecialistFolder read() {
    root_.need_word("format", {"loopwarden-specialists"}, "kind of file");
    const Value<std::int64_t> version =
        root_.need_integer("version", {1, kSpecialistVersion, "", "of the format"});
    if (version.valid && version.value == 1) inputs_ = kInputsOfVersion1;
    result_.plant = root_.need_text("plant", "prefix of the names of the specialists");
    read_training();
    read_figures();
    std::vector<MapReader> entries = root_.maybe_list("specialists", "one each");
    if (entries.empty()) root_.error("specialists", "must list at least one specialist");
    if (entries.size() > kMostSpecialists) {
      root_.error("specialists", fmt::format("must be at most {}", kMostSpecialists));
      return std::move(result_);
    }
    for (MapReader& entry : entries) read_specialist(entry);
    if (explaining_) read_team();
    return std::move(result_);
  }

 private:
  void read_training() {
    std::optional<MapReader> in = root_.need_section("training", "training data and method");
    if (!in) return;
    constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
    const auto count = [&](const char* key, const char* meaning) {
      return static_cast<std::size_t>(in->integer(key, {0, kMost, "", meaning}, 0).value);
    };
    result_.training.source = in->need_text("source", "in words");
    result_.training.seed = static_cast<std::uint64_t>(
        in->need_integer("seed", {0, kMost, "", "seed of all random numbers"}).value);
    result_.training.windows = count("windows", "simulated");
    result_.training.signatures = count("signatures", "used");
  }

  void read_figures() {
    std::optional<MapReader> in = root_.maybe_section("figures", "on data not used in training");
    if (!in) return;
    const auto percent = [&](const char* key) {
      return in->need_number(key, {"%", between(0.0, 100.0), ""}).value;
    };
    SpecialistFigures f;
    f.windows = static_cast<std::size_t>(
        in->need_integer("windows", {0, 1000000000, "", "looked at"}).value);
    f.named_percent = percent("named_percent");
    f.false_alarm_percent = percent("false_alarm_percent");
    f.undecided_percent = percent("undecided_percent");
    f.calibration_error = in->need_number("calibration_error", {"", between(0.0, 1.0), ""});
    result_.figures = f;
  }

  void read_team() {
    specialist::Team& team = *result_.team;
    if (std::optional<MapReader> in = root_.need_section("loop", "from CO to PV, as believed")) {
      specialist::LoopFacts& f = team.facts;
      f.period_s = in->need_number("sample_time", {"s", above(0.0), ""});
      f.gain = in->need_number("gain", {"PV units/CO unit", any_number(), ""});
      if (f.gain == 0.0) in->error("gain", "must not be 0");
      f.time_constant_s = in->need_number("time_constant", {"s", above(0.0), ""});
      f.dead_time_s = in->need_number("dead_time", {"s", at_least(0.0), ""});
      std::tie(f.co_low, f.co_high) =
          in->need_range("output", {"CO units", any_number(), ""}).value;
      std::tie(f.pv_low, f.pv_high) = in->need_range("range", {"PV units", any_number(), ""}).value;
    }
    team.temperature = root_.need_number("temperature", {"", above(0.0), "of the softmax"});
    const auto evidence = root_.maybe_points("evidence", "[[centre, scale], ...]",
                                             "of each kind of evidence, in order");
    if (evidence.value.size() != inputs_) {
      root_.error("evidence",
                  fmt::format("must have {} points (got {})", inputs_, evidence.value.size()));
      return;
    }
    if (inputs_ > specialist::kNetworkInputs && evidence.value.back().first != 0.0) {
      root_.error("evidence", fmt::format("point {} must be centred on 0: version 1 has no value "
                                          "for it; train these specialists again",
                                          inputs_));
    }
    for (std::size_t i = 0; i < specialist::kNetworkInputs; ++i) {
      team.centre[i] = evidence.value[i].first;
      team.scale[i] = evidence.value[i].second;
      if (!(team.scale[i] > 0.0)) {
        root_.error("evidence", fmt::format("scale must be > 0 (see point {})", i + 1));
      }
    }
    for (std::size_t c = 0; c < specialist::kConditions; ++c) {
      if (!seen_.contains(static_cast<Condition>(c))) {
        root_.error("specialists", fmt::format("no explaining specialist of class {}",
                                               to_text(static_cast<Condition>(c))));
      }
    }
  }

  void read_specialist(MapReader& in) {
    const Value<std::string> name = in.need_text("name", "of the specialist");
    const Value<Form> form = in.need_one_of("form", kForms, "form of the specialist");
    std::vector<std::string> classes;
    for (std::size_t c = 0; c < specialist::kConditions; ++c) {
      classes.emplace_back(to_text(static_cast<Condition>(c)));
    }
    if (form == Form::signature) classes.pop_back();
    const Value<std::string> word = in.need_word("class", classes, "class that it detects");
    const Value<std::string> layers = in.need_text("layers", "inputs-hidden-hidden-outputs");
    const Value<std::string> file = in.need_text("file", "of its weights, in this folder");
    const Value<std::string> sum = in.need_text("sha256", "of that file");
    specialist::Scaling scaling;
    double most_misfit = 0.0;
    if (form == Form::signature) {
      const auto range =
          in.need_range("scaling", {"PV units", any_number(), "values that become -1 and 1"});
      scaling = {0.5 * (range.value.first + range.value.second),
                 0.5 * (range.value.second - range.value.first)};
    } else {
      most_misfit = in.need_number("most_misfit", {"", any_number(), "acceptance limit"});
    }
    const std::optional<NetworkShape> shape = parse_layers(layers.value);
    if (layers.valid && !shape) {
      in.error("layers", fmt::format("must be four numbers from 1 to {} such as 31-10-10-31 "
                                     "(got '{}')",
                                     kMostNeurons, quotable(layers.value)));
    }
    if (file.valid && !is_plain_name(file.value)) {
      in.error("file", "must be the plain name of a file in this folder");
    }
    if (!shape || !word.valid || !form.valid || !file.valid || !is_plain_name(file.value) ||
        !sum.valid || !name.valid) {
      return;
    }
    const bool explains = form == Form::explaining;
    const NetworkShape wanted{explains ? inputs_ : specialist::kSide, shape->first_hidden,
                              shape->second_hidden, explains ? 1 : specialist::kSide};
    if (*shape != wanted) {
      in.error("layers", fmt::format("must begin with {} and end with {} for this form (got '{}')",
                                     wanted.inputs, wanted.outputs, layers.value));
      return;
    }
    std::optional<Weights> weights = read_weights(in, file.value, sum.value, *shape,
                                                  explains ? 0 : specialist::kSignatureSamples);
    if (!weights) return;
    const auto place = std::find(classes.begin(), classes.end(), word.value) - classes.begin();
    const auto condition = static_cast<Condition>(place);
    if (explains) {
      explaining_ = true;
      if (!seen_.insert(condition).second) {
        in.error("class", fmt::format("a second explaining specialist of class {}", word.value));
        return;
      }
      Eigen::MatrixXd& first = weights->network.layers[0].weights;
      first.conservativeResize(Eigen::NoChange, specialist::kNetworkInputs);
      if (!result_.team) result_.team.emplace();
      result_.team->members[static_cast<std::size_t>(place)] = {
          name.value, condition, std::move(weights->network), most_misfit};
    } else {
      result_.signatures.push_back({name.value, condition, std::move(weights->network), scaling,
                                    std::move(weights->target)});
    }
  }

  std::optional<Weights> read_weights(MapReader& in, const std::string& file,
                                      const std::string& sum, const NetworkShape& shape,
                                      std::size_t target) {
    const std::filesystem::path path = folder_ / file;
    Report report(path.string());
    const auto fail = [&]() -> std::optional<Weights> {
      std::vector<Diagnostic> found = report.take();
      for (Diagnostic& d : found) of_weights_.push_back(std::move(d));
      in.error("file", fmt::format("'{}' can't be used", file));
      return std::nullopt;
    };
    const std::size_t most = kMostBytesOfNumber * (shape.weights() + target) + 64;
    std::error_code error;
    const auto size = std::filesystem::file_size(path, error);
    if (!error && size > most) {
      report.error(
          {}, "",
          fmt::format("is too large: {} bytes, layers and target need at most {}", size, most));
      return fail();
    }
    const std::optional<std::string> text = read_source_file(path, report);
    if (!text) return fail();
    const std::string found = base::sha256_hex(*text);
    if (found != sum) {
      report.error({}, "", fmt::format("sha256 differs from the manifest: {}", found));
      return fail();
    }
    std::optional<Weights> weights = parse_weights(*text, shape, target, report);
    return weights ? std::move(weights) : fail();
  }

  MapReader root_;
  std::filesystem::path folder_;
  std::vector<Diagnostic>& of_weights_;
  SpecialistFolder result_;
  std::size_t inputs_ = specialist::kNetworkInputs;  // of the explaining networks in the file
  bool explaining_ = false;
  std::set<Condition> seen_;
};

}  // namespace

Loaded<SpecialistFolder> read_specialists(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / "manifest.yaml";
  Report report(path.string());
  SpecialistFolder specialists;
  std::vector<Diagnostic> of_weights;
  if (const std::optional<std::string> text = read_source_file(path, report)) {
    read_document(*text, report, [&](MapReader& in) {
      specialists = ManifestReader(in, folder, of_weights).read();
    });
  }
  Loaded<SpecialistFolder> result = loaded(std::move(specialists), report);
  for (Diagnostic& d : of_weights) result.diagnostics.push_back(std::move(d));
  return result;
}

}  // namespace loopwarden::config
