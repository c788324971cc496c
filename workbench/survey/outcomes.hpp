// SPDX-License-Identifier: Apache-2.0
// Stores the findings of fitters at the loops that a survey named. They are kept as lines of
// outcomes.csv next to survey.json. The next survey reports them.
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

// A fitter's answer, with the survey's statement on the loop.
struct FitterAnswer {
  std::string answered{};  // UTC, ISO 8601
  std::string tag{};
  AtValve found = AtValve::other;
  std::string note{};
  std::string verdict{}, grade{}, effect{};  // grade and effect: only for a valve effect
  std::string alternatives{};                // of the effect, separated by blanks
  std::optional<double> percent_of_span{}, probability{};
  std::string data_from{}, data_to{};  // judged data, by the export's clock, or s of the record

  // Returns whether the survey named the effect that the fitter found.
  bool right() const;
};

inline constexpr const char* kOutcomesFile = "outcomes.csv";
// A rejected finding is shown again once its size has grown by this factor.
inline constexpr double kGrown = 1.5;

// Returns the answers in the order in which they were given. The last answer to a finding replaces
// the earlier ones. Returns an empty list if the file does not exist. Throws CommandError.
std::vector<FitterAnswer> read_outcomes(const std::filesystem::path& path);
// Adds a line completely and waits for the disk, or leaves the file as it is. Throws CommandError.
void keep_outcome(const std::filesystem::path& path, const FitterAnswer& outcome);

// Returns the answer to store. `loop`: an entry of survey.json.
FitterAnswer answer_for(const nlohmann::json& loop, AtValve found, const std::string& note);

// Returns the time `s` of the loop's record, by the export's clock if it has one, otherwise in s.
std::string moment_of(const nlohmann::json& loop, double s);

// Adds "outcome" (the newest; null: no answer) and "held_back" to each loop.
void tell_outcomes(std::vector<nlohmann::json>& loops, const std::vector<FitterAnswer>& outcomes);

// Returns {"answered": 12, "precision": [{"grade": "seen", "right": 7, "of": 9, "low_percent":
// 45.3, "high_percent": 93.7}, ...]}.
nlohmann::json precision_json(const std::vector<FitterAnswer>& outcomes);
// Returns "found on this site: seen right in 7 of 9 (45 to 94 %), ..."; empty without answers.
std::string precision_text(const nlohmann::json& precision);

}  // namespace loopwarden::workbench
