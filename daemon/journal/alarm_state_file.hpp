// SPDX-License-Identifier: Apache-2.0
// A second copy of the stored alarm states, in case the journal's file is damaged. It is a small
// text file of one checksum and one JSON object, always replaced as a whole.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "daemon/journal/journal_entry.hpp"

namespace loopwarden::daemon::journal {

class AlarmStateFile {
 public:
  explicit AlarmStateFile(std::filesystem::path path) : path_(std::move(path)) {}

  // Returns false, with the reason in `why`, if the disk failed. The old copy then remains.
  bool save(const AlarmStates& states, std::string& why) const;
  // Returns nullopt if the file is missing or damaged. If it is damaged, `why` is set.
  std::optional<AlarmStates> load(std::string& why) const;

 private:
  std::filesystem::path path_;
};

}  // namespace loopwarden::daemon::journal
