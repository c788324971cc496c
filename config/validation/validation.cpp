// SPDX-License-Identifier: Apache-2.0
#include "config/validation/validation.hpp"

#include <exception>
#include <variant>
#include <vector>

#include "hal/replay/replay_loop_io.hpp"

namespace loopwarden::config {
namespace {

void check_record(const LoopFile& loop, Report& report) {
  const auto* replay = std::get_if<hal::replay::ReplaySettings>(&loop.config.io);
  if (replay == nullptr) return;
  try {
    hal::replay::read_replayed(*replay);
  } catch (const std::exception& e) {
    report.error(loop.record, "io.record", e.what());
  }
}

LoopCheck check_by(SpecialistFiles& specialists) {
  return [&specialists](const LoopFile& loop, Report& report,
                        std::vector<Diagnostic>& of_named_files) {
    specialists.check(loop, report, of_named_files);
    check_record(loop, report);
  };
}

}  // namespace

Validated validate(const std::filesystem::path& directory, const Drafts& drafts) {
  SpecialistFiles specialists;
  Validated validated{.reading = read_folder(directory, drafts, check_by(specialists)),
                      .specialists = {}};
  validated.specialists = specialists.take();
  return validated;
}

Loaded<Configuration> validate_all(const std::filesystem::path& directory, const Drafts& drafts) {
  return loaded(validate(directory, drafts).reading);
}

Loaded<LoopConfig> validate_loop_file(const std::filesystem::path& path) {
  SpecialistFiles specialists;
  return read_loop_file(path, check_by(specialists));
}

}  // namespace loopwarden::config
