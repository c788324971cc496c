// SPDX-License-Identifier: Apache-2.0
// What fitters found at the loops that a survey named: kept beside survey.json as a line each in outcomes.csv, told by
// the next survey.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::workbench {

enum class AtValve : std::uint8_t { stiction, backlash, air, nothing, other };
inline constexpr std::array kAtValve{AtValve::stiction, AtValve::backlash, AtValve::air,
                                     AtValve::nothing, AtValve::other};
const char* to_text(AtValve found) noexcept;
std::optional<AtValve> found_from(std::string_view word) noexcept;
std::vector<std::string> found_words();

// An answer, with what the survey had said of the loop.
struct FitterAnswer {
  std::string answered{};  // UTC, ISO 8601
  std::string tag{};
  AtValve found = AtValve::other;
  std::string note{};
  std::string verdict{}, grade{}, effect{};  // grade and effect: of a valve effect
  std::string alternatives{};                // of the effect, blanks between them
  std::optional<double> percent_of_span{}, probability{};
  std::string data_from{}, data_to{};  // what was judged, by the export's clock, or s of the record

  // The finding had the right name.
  bool right() const;
};

inline constexpr const char* kOutcomesFile = "outcomes.csv";
// A finding that was rejected is shown in its place again once its size has grown by this.
inline constexpr double kGrown = 1.5;

// In the order in which they were given; of several for one finding the last. Empty where there is no file. Throws
// CommandError.
std::vector<FitterAnswer> read_outcomes(const std::filesystem::path& path);
// Adds a line: whole and on the disk, or not at all. Throws CommandError.
void keep_outcome(const std::filesystem::path& path, const FitterAnswer& outcome);

// `loop` of survey.json.
FitterAnswer answer_for(const nlohmann::json& loop, AtValve found, const std::string& note);

// The time `s` of the loop's record, by the export's clock where it has one, else in s.
std::string moment_of(const nlohmann::json& loop, double s);

// Adds "outcome" (the newest; null: none) and "held_back" to each loop.
void tell_outcomes(std::vector<nlohmann::json>& loops, const std::vector<FitterAnswer>& outcomes);

// {"answered": 12, "precision": [{"grade": "seen", "right": 7, "of": 9, "low_percent": 45.3, "high_percent": 93.7}, ...]}
nlohmann::json precision_json(const std::vector<FitterAnswer>& outcomes);
// "found on this site: seen right in 7 of 9 (45 to 94 %), ..."; empty where nothing was answered.
std::string precision_text(const nlohmann::json& precision);

}  // namespace loopwarden::workbench
