// SPDX-License-Identifier: Apache-2.0
// Reads any bytes as the site's rules and as its costs. The readers must not crash, and must report
// every refused file.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "workbench/records/rules_file.hpp"
#include "workbench/survey/costs.hpp"
#include "workbench/survey/site_names.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace loopwarden;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto rules = workbench::read_rules_text("rules.yaml", text);
  if (!rules && config::to_text(rules.diagnostics).empty()) std::abort();
  const auto costs = workbench::read_costs_text("costs.yaml", text);
  if (!costs && config::to_text(costs.diagnostics).empty()) std::abort();
  // A part of a tag is within the tag.
  const std::string_view part = workbench::instrument_part(text);
  if (part.data() < text.data() || part.data() + part.size() > text.data() + size) std::abort();
  return 0;
}
