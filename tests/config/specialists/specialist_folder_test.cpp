// SPDX-License-Identifier: Apache-2.0
#include "base/digest/digest.hpp"
#include "config/specialists/specialist_folder.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::specialist_folder_test {
namespace {

using config::SpecialistFolder;
using specialist::Condition;

SpecialistFolder some_folder() {
  SpecialistFolder f;
  f.plant = "P7";
  f.training = {"simulated loop of \"x\" \\ y", 42, 700, 25};
  f.figures = config::SpecialistFigures{900, 81.25, 0.5, 12.5, 0.0125};
  f.team.emplace();
  f.team->facts = {0.1, -1.25, 1.7, 2.6, 4.0, 20.0, 0.0, 500.0};
  f.team->temperature = 1.125;
  for (std::size_t i = 0; i < specialist::kNetworkInputs; ++i) {
    f.team->centre[i] = 0.5 * static_cast<double>(i);
    f.team->scale[i] = 1.0 + static_cast<double>(i);
  }
  for (std::size_t c = 0; c < specialist::kConditions; ++c) {
    const auto condition = static_cast<Condition>(c);
    f.team->members[c] = {std::string("P7-") + to_text(condition), condition,
                          specialist::random_network({specialist::kNetworkInputs, 3, 2, 1}, c),
                          1.5};
  }
  specialist::SignatureSpecialist s{
      "P7S4",
      Condition::stiction,
      specialist::random_network({specialist::kSide, 4, 4, specialist::kSide}, 9),
      {5.0, 2.5},
      {}};
  s.target.assign(specialist::kSignatureSamples, 4.25);
  f.signatures.push_back(s);
  return f;
}

// Returns the text of the error for a written folder after `change`.
template <class Change>
std::string refusal(Change change) {
  const TemporaryFolder folder;
  REQUIRE(config::write_specialists(some_folder(), folder.path()).empty());
  change(folder.path());
  const auto read = config::read_specialists(folder.path());
  CHECK_FALSE(read);
  return config::to_text(read.diagnostics);
}

void replace(const std::filesystem::path& file, const std::string& from, const std::string& to) {
  std::string text = read_file(file);
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  write_file(file, text.replace(at, from.size(), to));
}

// New weights with a matching manifest.
void put_weights(const std::filesystem::path& folder, const std::string& text) {
  const std::string before = loopwarden::base::sha256_hex(read_file(folder / "P7S4.weights"));
  write_file(folder / "P7S4.weights", text);
  replace(folder / "manifest.yaml", before, loopwarden::base::sha256_hex(text));
}

// Copies the specialists as version 1 wrote them into a separate folder.
void copy_version_1(const std::filesystem::path& to) {
  std::filesystem::copy(LOOPWARDEN_SOURCE_DIR "/tests/golden/specialists-1", to,
                        std::filesystem::copy_options::recursive);
}

// WindowFits with a different value in every field.
specialist::WindowFits varied_explanations() {
  specialist::WindowFits f;
  f.usable = true;
  f.noise = 0.1;
  f.co_range = 10.0;
  f.pv_range = 8.0;
  f.co_travel = 30.0;
  f.co_fastest = 1.5;
  f.reversals = 6.0;
  double k = 0.0;
  for (specialist::FaultFit& fit : f.fits) {
    k += 1.0;
    fit.mse = 0.01 + 0.004 * k * k;
    fit.innovation = 0.009 + 0.001 * k;
    fit.size = 1.0 + 0.7 * k;
    fit.shape = 0.1 * k;
    fit.limit = 0.2 * k;
    fit.gain_off = 0.3 * k - 1.0;
    fit.dead_time_off = 0.2 * k - 0.5;
    fit.lag_off = 0.5 - 0.1 * k;
  }
  return f;
}

using Catch::Matchers::Contains;

}  // namespace

TEST_CASE("specialists read back as they were written", "[specialists]") {
  const TemporaryFolder folder;
  const SpecialistFolder written = some_folder();
  REQUIRE(config::write_specialists(written, folder.path()).empty());
  const auto read = config::read_specialists(folder.path());
  INFO(config::to_text(read.diagnostics));
  REQUIRE(read);
  CHECK(read->plant == "P7");
  CHECK(read->training.source == written.training.source);
  CHECK(read->training.seed == 42);
  CHECK(read->figures->named_percent == 81.25);
  REQUIRE(read->team);
  CHECK(read->team->facts == written.team->facts);
  CHECK(read->team->temperature == 1.125);
  CHECK(read->team->scale == written.team->scale);
  for (std::size_t c = 0; c < specialist::kConditions; ++c) {
    const specialist::TeamMember& a = read->team->members[c];
    const specialist::TeamMember& b = written.team->members[c];
    CHECK(a.name == b.name);
    CHECK(a.condition == b.condition);
    CHECK(a.most_misfit == b.most_misfit);
    for (std::size_t l = 0; l < 3; ++l) {
      CHECK(a.network.layers[l].weights ==
            b.network.layers[l].weights.cast<float>().cast<double>());
      CHECK(a.network.layers[l].bias == b.network.layers[l].bias.cast<float>().cast<double>());
    }
  }
  REQUIRE(read->signatures.size() == 1);
  CHECK(read->signatures[0].scaling == specialist::Scaling{5.0, 2.5});
  CHECK(read->signatures[0].target == written.signatures[0].target);
}

TEST_CASE("specialists of version 1 answer as they did, and are written as version 2",
          "[specialists]") {
  const auto read = config::read_specialists(LOOPWARDEN_SOURCE_DIR "/tests/golden/specialists-1");
  INFO(config::to_text(read.diagnostics));
  REQUIRE(read);
  // The answers of the program that wrote them. Another order of the evidence would change them.
  const std::array expected{0.10330062980232402, 0.15376073103388316, 0.31549336509361009,
                            0.16513702899959684, 0.1625196844388796,  0.099788560631706325};
  const auto answers_so = [&](const specialist::Team& team) {
    const auto verdict = specialist::TeamJudge(team).judge(varied_explanations());
    for (std::size_t c = 0; c < specialist::kConditions; ++c) {
      CHECK(verdict.probabilities[c] == Approx(expected[c]).epsilon(1e-9));
    }
  };
  answers_so(*read->team);
  // Alarm evidence keeps a copy of the specialists that judged.
  const TemporaryFolder folder;
  REQUIRE(config::write_specialists(*read.value, folder.path()).empty());
  CHECK_THAT(read_file(folder / "manifest.yaml"), Contains("version: 2"));
  const auto again = config::read_specialists(folder.path());
  INFO(config::to_text(again.diagnostics));
  REQUIRE(again);
  answers_so(*again->team);
}

TEST_CASE("a manifest with evidence of the other version is refused with instructions",
          "[specialists]") {
  const auto refusal_of_version_1 = [](const std::string& from, const std::string& to) {
    const TemporaryFolder folder;
    copy_version_1(folder.path());
    replace(folder / "manifest.yaml", from, to);
    const auto read = config::read_specialists(folder.path());
    CHECK_FALSE(read);
    return config::to_text(read.diagnostics);
  };
  CHECK_THAT(refusal_of_version_1("version: 1", "version: 2"),
             Contains("must begin with 52") && Contains("53-3-2-1"));
  CHECK_THAT(
      refusal_of_version_1("- [0, 0.001]", "- [0.5, 0.001]"),
      Contains("point 53 must be centred on 0") && Contains("train these specialists again"));
  CHECK_THAT(refusal([](const std::filesystem::path& f) {
               replace(f / "manifest.yaml", "version: 2", "version: 1");
             }),
             Contains("must begin with 53"));
}

TEST_CASE("every input of a written manifest has its name", "[specialists]") {
  const TemporaryFolder folder;
  REQUIRE(config::write_specialists(some_folder(), folder.path()).empty());
  const std::string text = read_file(folder / "manifest.yaml");
  CHECK_THAT(text, Contains("- [0, 1]  # healthy_misfit\n"));
  CHECK_THAT(text, Contains("- [25.5, 52]  # co_reversals\nspecialists:"));
}

TEST_CASE("an untrusted folder is refused with the reason", "[specialists]") {
  using Path = std::filesystem::path;
  CHECK_THAT(
      refusal([](const Path& f) { replace(f / "manifest.yaml", "version: 2", "version: 3"); }),
      Contains("from 1 to 2"));
  CHECK_THAT(refusal([](const Path& f) {
               replace(f / "manifest.yaml", "loopwarden-specialists", "loopwarden-loops");
             }),
             Contains("format"));
  CHECK_THAT(refusal([](const Path& f) { std::filesystem::remove(f / "manifest.yaml"); }),
             Contains("manifest.yaml"));
  CHECK_THAT(refusal([](const Path& f) { std::filesystem::remove(f / "P7S4.weights"); }),
             Contains("P7S4.weights"));
  CHECK_THAT(refusal([](const Path& f) { replace(f / "P7S4.weights", "4.25", "4.26"); }),
             Contains("sha256 differs"));
  CHECK_THAT(refusal([](const Path& f) {
               replace(f / "manifest.yaml", "layers: 31-4-4-31", "layers: 31-4-5-31");
             }),
             Contains("numbers"));
  CHECK_THAT(refusal([](const Path& f) {
               replace(f / "manifest.yaml", "layers: 31-4-4-31", "layers: 30-4-4-31");
             }),
             Contains("must begin with 31"));
  CHECK_THAT(refusal([](const Path& f) {
               replace(f / "manifest.yaml", "layers: 31-4-4-31", "layers: 31-4-400-31");
             }),
             Contains("four numbers"));
  CHECK_THAT(refusal([](const Path& f) {
               replace(f / "manifest.yaml", "class: backlash", "class: stiction");
             }),
             Contains("second explaining specialist"));
  CHECK_THAT(refusal([](const Path& f) {
               replace(f / "manifest.yaml", "file: P7S4.weights", "file: ../P7S4.weights");
             }),
             Contains("plain name"));
  CHECK_THAT(refusal([](const Path& f) {
               replace(f / "manifest.yaml", "temperature: 1.125", "temperature: .nan");
             }),
             Contains("temperature"));
  CHECK_THAT(refusal([](const Path& f) { replace(f / "manifest.yaml", "plant:", "plnt:"); }),
             Contains("plnt"));
}

TEST_CASE("weights must be as many as the layers take, and finite", "[specialists]") {
  using Path = std::filesystem::path;
  const auto changed = [](auto change) {
    return refusal([&](const Path& f) {
      std::string text = read_file(f / "P7S4.weights");
      change(text);
      put_weights(f, text);
    });
  };
  CHECK_THAT(changed([](std::string& t) { t += "1.0\n"; }), Contains("has more"));
  CHECK_THAT(changed([](std::string& t) { t.resize(t.rfind("4.25")); }), Contains("must hold"));
  CHECK_THAT(changed([](std::string& t) { t.replace(t.rfind("4.25"), 4, "nan "); }),
             Contains("finite number"));
  CHECK_THAT(changed([](std::string& t) { t.replace(t.rfind("4.25"), 4, "1e99"); }),
             Contains("finite number"));
  CHECK_THAT(changed([](std::string& t) { t.replace(t.rfind("4.25"), 4, "4,25"); }),
             Contains("finite number"));
  CHECK_THAT(changed([](std::string& t) { t.insert(0, "#"); }), Contains("no file of weights"));
  CHECK_THAT(changed([](std::string& t) { t.append(100000, ' '); }), Contains("too large"));
}

TEST_CASE("specialists that are replaced stay whole until the new manifest is written",
          "[config][specialists]") {
  const TemporaryFolder folder;
  REQUIRE(config::write_specialists(some_folder(), folder.path()).empty());
  SpecialistFolder other = some_folder();
  for (auto& member : other.team->members) {
    member.network = specialist::random_network({specialist::kNetworkInputs, 3, 2, 1}, 77);
  }
  // The state after each file, as after a kill.
  std::size_t files = 0;
  config::write_specialists(other, folder.path(),
                            [&](const std::string& name, const std::string& text) {
                              INFO(name);
                              write_file(folder / name, text);
                              CHECK(config::read_specialists(folder.path()));
                              ++files;
                            });
  CHECK(files == specialist::kConditions + 2);
  // One write removes the files that are not needed any more. Writing the same again keeps all
  // names.
  REQUIRE(config::write_specialists(some_folder(), folder.path()).empty());
  const auto named = [&] {
    auto names = config::weight_files(folder.path());
    std::sort(names.begin(), names.end());
    return names;
  };
  const auto before = named();
  REQUIRE(config::write_specialists(some_folder(), folder.path()).empty());
  CHECK(named() == before);
  const auto read = config::read_specialists(folder.path());
  REQUIRE(read);
}

}  // namespace loopwarden::tests::specialist_folder_test
