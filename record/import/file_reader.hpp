// SPDX-License-Identifier: Apache-2.0
// The rows of one file: values of the loops that it has, with their times.
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

// Called now and then with the share of the work that is done, 0 to 1.
using ImportProgress = std::function<void(double)>;
inline constexpr std::size_t kProgressRows = 1U << 16U;
inline constexpr std::size_t kHeadLines = 400;  // that the layout is found from

// What one file holds of one loop.
struct ImportPart {
  Signals signals;
  std::optional<TimePoint> origin;   // of time 0, where times are absolute
  std::size_t shifted_hours = 0;     // the end of summer time in local times
  std::vector<std::string> remarks;  // what people should know of how it was read
  std::optional<RecordError> error;  // what kept it from being read
  std::size_t file = 0;              // for Importer::file()
};

// What a column or a tag feeds. A cell that can't be read costs its loop, not the file's other ones.
struct SignalTarget {
  Signal* signal = nullptr;
  Role role = Role::pv;
  std::optional<RecordError>* error = nullptr;
  const ModeWords* mode_words = nullptr;
  std::string name{};  // column or tag, for messages
};

// What of one file goes where.
struct Feed {
  std::vector<std::pair<std::size_t, SignalTarget>> columns;  // wide, pairs
  std::unordered_map<std::string, SignalTarget> tags;         // long
  std::vector<ImportPart*> parts;
  // One tag may serve several loops; the second one reads a copy.
  std::vector<std::pair<SignalTarget, std::string>> copies;

  void add(ImportPart& part, const LoopSignals& signals, const Layout& layout);
  void copy();
  void forget_empty();
};

// Throws RecordError where nothing of the file can be used; what keeps one loop from being read goes to its part.
void read_into(Feed& feed, TextSource& text, const Layout& layout, const ImportOptions& options,
               const ImportProgress& progress);

}  // namespace loopwarden::record
