// SPDX-License-Identifier: Apache-2.0
// Loads the specialists and twins that the loops' files refer to, each once.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "config/diagnostic.hpp"
#include "config/loop_config.hpp"
#include "config/loop_reader.hpp"
#include "config/specialists/specialist_folder.hpp"
#include "model/watch/window_builder.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::config {

struct Specialists {
  struct Folder {
    SpecialistFolder content;  // with a team; without the signature form
    std::uint32_t hash = 0;    // CRC-32 of its manifest, which has the digests of its weights
  };
  std::map<std::string, Folder> folders;            // by name
  std::uint32_t hash = 0;                           // CRC-32 of all manifests; 0: no manifest
  std::map<std::string, plant::LoopModel> twins{};  // by file
};

// Returns how a loop's data is divided into windows.
watch::WindowSettings window_of(const LoopConfig& loop);

// Loads specialists and twins as loops refer to them. It refuses invalid folders, specialists with
// another sample time than the loop's windows, and twins with another sample time or other ranges
// than the loop.
class SpecialistFiles {
 public:
  // See LoopCheck (config_reader.hpp).
  void check(const LoopFile& file, Report& report, std::vector<Diagnostic>& of_named_files);
  // Returns the loaded files.
  Specialists take() { return std::move(read_); }

 private:
  void check_twin(const LoopFile& loop, Report& report, std::vector<Diagnostic>& of_named_files);
  void check_specialists(const LoopFile& loop, Report& report,
                         std::vector<Diagnostic>& of_named_files);

  Specialists read_;
  std::set<std::string> failed_;  // files and folders
};

}  // namespace loopwarden::config
