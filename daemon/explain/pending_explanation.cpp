// SPDX-License-Identifier: Apache-2.0
#include "daemon/explain/pending_explanation.hpp"

#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

#include "daemon/explain/explanation_file.hpp"

namespace loopwarden::daemon {
namespace {

using nlohmann::json;

std::filesystem::path file_in(const std::filesystem::path& folder) {
  return folder / "pending.json";
}

}  // namespace

void write_pending(const PendingExplanation& pending, const std::filesystem::path& folder) {
  const json text = {{"enough_s", pending.enough_s}, {"there_s", pending.there_s}};
  replace_text(file_in(folder), text.dump() + "\n");
}

std::optional<PendingExplanation> read_pending(const std::filesystem::path& folder) {
  std::ifstream stream(file_in(folder), std::ios::binary);
  if (!stream) return std::nullopt;
  try {
    const json text = json::parse(stream);
    return PendingExplanation{.enough_s = text.at("enough_s").get<double>(),
                              .there_s = text.at("there_s").get<double>()};
  } catch (const json::exception&) {
    return PendingExplanation{};
  }
}

void end_pending(const std::filesystem::path& folder) noexcept {
  std::error_code ignored;  // a leftover file is found at the next start, next to its explanation
  std::filesystem::remove(file_in(folder), ignored);
}

}  // namespace loopwarden::daemon
