// SPDX-License-Identifier: Apache-2.0
// Converts signals with individual times to a record with a constant period, and reports the
// method.
//
//   regular  steps within 1 % of their median: the samples are used as they are
//   polled   most steps within a third of their median: missing rows become missing samples. If
//            times jitter, values are interpolated linearly, and the change of PV is reported
//   stored   all others: values as an archive keeps them, on the scan period of their times or on a
//            period derived from their density. They are filled by the rule of the archive
//            (model/analysis/archive.hpp): the last value, or straight lines. If no rule is found,
//            CO holds its last value, as controllers do. PV is interpolated linearly; `pv_drawn`
//            marks these samples
//
// A value that the export marks as bad is missing, and so are the samples up to the next good one.
// The set point and the mode always hold their last value.
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

// Values of a cell: kEmpty has no information, kBad marks a missing value.
inline constexpr double kEmpty = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kBad = std::numeric_limits<double>::infinity();

struct Signal {
  std::shared_ptr<std::vector<double>> time_s;  // rising; several signals may share it
  std::vector<double> value;
  std::size_t bad = 0;
  std::size_t questionable = 0;
  std::string unit;  // after the numbers in the cells
  std::map<std::string, std::size_t>
      words;  // unknown words, treated as bad values, with their numbers of cells

  bool empty() const noexcept { return value.empty(); }
};
using Signals = std::array<Signal, kRoles>;

// An unknown word that was treated as a bad value.
struct BadWord {
  std::string file;
  std::string signal;  // column or tag
  std::string word;
  std::size_t cells = 0;
};

struct ImportNotes {
  std::string tag;    // of the loop; empty if the export has none
  std::string files;  // source of the values
  std::array<std::string, kRoles> names, units;
  std::array<std::optional<SignalRange>, kRoles> ranges;  // by the site's rules
  std::string kind;                                       // of the loop, by the site's rules
  std::string layout;                                     // description; empty for the fixed format
  std::optional<TimePoint> start;  // of the first sample, if the export states it
  double period_s = 0.0;
  std::size_t missing = 0;  // samples without PV or CO
  std::size_t bad = 0;      // number of cells marked bad by a word or a quality
  std::size_t questionable = 0;
  std::size_t same_time = 0;  // values replaced by a later one with the same time
  std::string resampled;      // description of the method; empty: not resampled
  double moved_pv = 0.0;      // PV units, rms: change of PV by resampling of jittered times
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
  // Samples of PV between stored values that were not filled by a rule of an archive; empty: no
  // such sample.
  std::vector<bool> pv_drawn{};
};

// Returns one line per word and file, for all its signals: "e.csv: 'Wartung' in 12 cells of 3
// signals: taken as ...".
std::string bad_words_text(const std::vector<BadWord>& words);

// Moves the signals' memory into the result. `notes` contains the results of reading. Throws
// RecordError if there is no PV or no period. It also throws if a period that the user did not set
// makes more than 50 samples per value.
Imported on_constant_period(Signals signals, const ImportOptions& options, ImportNotes notes,
                            const std::string& place);

// Detects the effects of an archive from the samples of a regular record. Fills columns in which
// most cells are empty.
void recognise_archive(Imported& imported, const ImportOptions& options);

}  // namespace loopwarden::record
