// SPDX-License-Identifier: Apache-2.0
// Reads the rows of one file: values and times of its loops.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "record/import/constant_period.hpp"
#include "record/import/layout.hpp"
#include "record/import/text_source.hpp"

namespace loopwarden::record {

// Called from time to time with the finished share of the work, 0 to 1.
using ImportProgress = std::function<void(double)>;
inline constexpr std::size_t kProgressRows = 1U << 16U;
inline constexpr std::size_t kHeadLines = 400;  // number of lines used to find the layout

// The data of one loop in one file.
struct ImportPart {
  Signals signals;
  std::optional<TimePoint> origin;   // time at 0, if times are absolute
  std::size_t shifted_hours = 0;     // shift at the end of summer time in local times
  std::vector<std::string> remarks;  // remarks about the reading, for people
  std::optional<RecordError> error;  // the reason if it could not be read
  std::size_t file = 0;              // for Importer::file()
};

// The target of a column or a tag. A cell that can't be read is an error of its loop only, not of
// other loops in the file.
struct SignalTarget {
  Signal* signal = nullptr;
  Role role = Role::pv;
  std::optional<RecordError>* error = nullptr;
  const ModeWords* mode_words = nullptr;
  std::string name{};  // column or tag, for messages
};

// The targets of all columns and tags of one file.
struct Feed {
  std::vector<std::pair<std::size_t, SignalTarget>> columns;  // wide, pairs
  std::unordered_map<std::string, SignalTarget> tags;         // long
  std::vector<ImportPart*> parts;
  // If a tag is used by several loops, all except the first get a copy.
  std::vector<std::pair<SignalTarget, std::string>> copies;

  void add(ImportPart& part, const LoopSignals& signals, const Layout& layout);
  void copy();
  void forget_empty();
};

// Reads the file. Throws RecordError if no part of the file can be used. Errors of one loop are
// stored in its part.
void read_into(Feed& feed, TextSource& text, const Layout& layout, const ImportOptions& options,
               const ImportProgress& progress);

}  // namespace loopwarden::record
