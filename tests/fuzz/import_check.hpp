// SPDX-License-Identifier: Apache-2.0
// Checks an import: it is refused with its name and a reason, or every loop in it becomes a record.
#pragma once

#include <unistd.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "record/import/importer.hpp"
#include "tests/fuzz/require.hpp"

namespace loopwarden::tests::fuzz {

using namespace loopwarden::record;

inline void check(const Imported& imported) {
  const Record& record = imported.record;
  require(record.size() >= 2, "two samples at least");
  require(std::isfinite(record.period_s) && record.period_s > 0.0, "a positive period");
  require(record.period_s == imported.notes.period_s, "the period that is said");
  check_columns(record);
}

// Imports any bytes as a file with this extension.
inline void check_export(const std::uint8_t* data, std::size_t size, const char* ending) {
  static const std::filesystem::path path =
      "/dev/shm/loopwarden_import_fuzz_" + std::to_string(::getpid()) + ending;
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  ImportOptions options;
  // Few samples, because another test covers the size that a wild pair of times would need.
  options.most_samples = 10000;
  try {
    Importer importer({path}, options);
    std::vector<std::size_t> all;
    for (std::size_t k = 0; k < importer.loops().size(); ++k) {
      if (importer.loops()[k].signals.has(Role::pv)) all.push_back(k);
    }
    importer.read(
        all, [](std::size_t, const Imported& imported) { check(imported); },
        [](std::size_t, std::size_t, const RecordError& error) {
          require(std::string_view(error.what()).find("loopwarden_import_fuzz") !=
                      std::string_view::npos,
                  "the file's name in the message");
        });
  } catch (const RecordError& error) {
    require(std::string_view(error.what()).find("loopwarden_import_fuzz") != std::string_view::npos,
            "the file's name in the message");
  }
}

}  // namespace loopwarden::tests::fuzz
