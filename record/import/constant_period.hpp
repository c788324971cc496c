// SPDX-License-Identifier: Apache-2.0
// From signals with times of their own to a record on a constant period, and what that took.
//
//   regular      steps within 1 % of their median: the samples as they are
//   polled       most steps within a third of their median: rows that are missing become missing samples; where times
//                jitter, values are read off the straight line between neighbours, and what that moves PV by is stated
//   stored       anything else: values as an archive keeps them, on the scan that their times are multiples of, or on
//                a period that their density gives; filled by the rule of the archive (model/analysis/archive.hpp):
//                the last value, or straight lines. Where no rule shows, CO holds its last value, as controllers do,
//                and PV is drawn in straight lines, which `pv_drawn` tells from values
//
// A value that the export calls bad is missing, and missing until the next good one. The set point and the mode always
// hold their last value.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "model/analysis/archive.hpp"
#include "record/import/layout.hpp"
#include "record/import/tags.hpp"
#include "record/record_csv.hpp"

namespace loopwarden::record {

// An empty cell tells nothing; a bad one that there was no value.
inline constexpr double kEmpty = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kBad = std::numeric_limits<double>::infinity();

struct Signal {
  std::shared_ptr<std::vector<double>> time_s;  // rising; several signals may share it
  std::vector<double> value;
  std::size_t bad = 0;
  std::size_t questionable = 0;
  std::string unit;  // in the cells, behind the numbers
  std::map<std::string, std::size_t>
      words;  // that nobody knows, taken as bad values: cells of each

  bool empty() const noexcept { return value.empty(); }
};
using Signals = std::array<Signal, kRoles>;

// A word that nobody knows and that was taken as a bad value.
struct BadWord {
  std::string file;
  std::string signal;  // column or tag
  std::string word;
  std::size_t cells = 0;
};

struct ImportNotes {
  std::string tag;    // of the loop; empty where the export has none
  std::string files;  // where it was read
  std::array<std::string, kRoles> names, units;
  std::array<std::optional<SignalRange>, kRoles> ranges;  // by the site's rules
  std::string kind;                                       // of the loop, by the site's rules
  std::string layout;                                     // in words; empty for the fixed format
  std::optional<TimePoint> start;  // of the first sample, where the export tells
  double period_s = 0.0;
  std::size_t missing = 0;  // samples without PV or CO
  std::size_t bad = 0;      // of the cells, by name or by quality
  std::size_t questionable = 0;
  std::size_t same_time = 0;  // values that a later one with the same time replaced
  std::string resampled;      // how, in words; empty: not at all
  double moved_pv = 0.0;      // PV units, rms: what resampling jittered times moved PV by
  analysis::ArchivedSignal pv, co;
  std::vector<std::string> remarks;
  std::vector<BadWord> words;

  bool compressed() const noexcept {
    return pv.kind != analysis::ArchiveKind::none || co.kind != analysis::ArchiveKind::none;
  }
};

struct Imported {
  Record record;
  ImportNotes notes;
  // Samples of PV between stored values that no rule of an archive fills; empty: there are none.
  std::vector<bool> pv_drawn{};
};

// A line a word and file, whatever signals it stands in: "e.csv: 'Wartung' in 12 cells of 3 signals: taken as ...".
std::string bad_words_text(const std::vector<BadWord>& words);

// Takes the signals' memory. `notes` has what reading found. Throws RecordError where there is no PV, no period, or one
// that makes more than 50 samples a value unless it is told.
Imported on_constant_period(Signals signals, const ImportOptions& options, ImportNotes notes,
                            const std::string& place);

// What the samples themselves tell of an archive, for a record that is regular already. Fills columns in which most
// cells are empty.
void recognise_archive(Imported& imported, const ImportOptions& options);

}  // namespace loopwarden::record
