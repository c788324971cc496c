// SPDX-License-Identifier: Apache-2.0
// Interprets columns of qualities by their names, words and codes. Vocabulary of OPC DA and OPC UA,
// PI, AVEVA, Siemens, Honeywell PHD, Aspen IP.21, Ignition and eWON, in several languages.
//
// All codes of a column are interpreted together, because a column has one scheme:
//
//   0 and 1         by the column's name (Valid, Questionable); otherwise the more frequent is good
//   percent         Confidence, or codes up to 100 with 100 among them: 100 good, 0 bad
//   OPC UA          codes from 0x40000000, below 0, or written 0x........: the two highest bits
//   AVEVA           0, 1, 133: good, bad, doubtful
//   eWON            3 is good, if the column is IQuality or 3 is the most frequent code
//   OPC DA, Siemens the two highest bits of the low byte: 0xC0, 0x80 good, 0x40 doubtful
//
// An unknown word or code is bad and is reported with its count. If no cell has a known good state,
// an unknown state with more than half of the cells is treated as good, and reported.
//
// A column with fractions is not used, and this is reported. A Status, State or Flags with unknown
// states is not used either, with two exceptions. It is used if one of its states applies to values
// only (good, bad). A Status or State is also used if nearly all its cells have one state.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace loopwarden::record {

enum class SampleQuality : std::uint8_t { good, questionable, bad };

// Kind of a column of qualities, by its name.
enum class QualityKind : std::uint8_t {
  none,          // no column of qualities
  state,         // Quality, OPCQuality, StatusCode
  status,        // Status, State: may have another meaning
  flags,         // bits of a vendor
  good_flag,     // Validity, IsGood
  bad_flag,      // IsBad, Error
  doubt_flag,    // Questionable, Substituted
  percent,       // Confidence, PercentGood
  industrial_pc  // IQuality of eWON
};
QualityKind quality_kind(std::string_view column_name);

// Returns the quality of a single word; nullopt: unknown.
std::optional<SampleQuality> quality_of_word(std::string_view word);

// Returns whether the word means that a value is good and rarely has another meaning.
bool says_good(std::string_view word);

// The cells of one column: add all of them, call settle(), then query each one.
class QualityCells {
 public:
  explicit QualityCells(QualityKind kind) : kind_(kind) {}

  using Id = std::uint16_t;
  Id add(std::string_view cell);
  // Returns remarks for people: "'Gestört' in 12 cells: not known, taken as bad".
  std::vector<std::string> settle();
  SampleQuality quality(Id id) const { return states_[id].quality; }
  // Returns the most frequent state, for a message.
  std::string most_frequent() const;

 private:
  struct State {
    std::string text;
    std::size_t cells = 0;
    std::optional<std::int64_t> code;
    bool hexadecimal = false;
    bool fraction = false;
    bool known = false;
    SampleQuality quality = SampleQuality::good;
  };
  void settle_words();
  void settle_codes();
  void settle_flags();
  bool has_other_meaning() const;
  SampleQuality by_name(bool flag) const;

  QualityKind kind_;
  std::vector<State> states_;
  std::unordered_map<std::string, Id> ids_;
  Id last_ = 0;
  bool more_frequent_taken_ = false;
};

}  // namespace loopwarden::record
