// SPDX-License-Identifier: Apache-2.0
// Reads the rules of a site for the names of its columns and tags (docs/reference/import-formats.md
// lists every key).
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "config/diagnostic.hpp"
#include "config/key_reference.hpp"
#include "record/import/tag_rules.hpp"

namespace loopwarden::workbench {

struct SiteRules {
  std::vector<record::TagRule> rules;  // of names
  std::vector<record::TagText> tags;   // of loops
};

config::Loaded<SiteRules> read_rules_file(const std::filesystem::path& path);
config::Loaded<SiteRules> read_rules_text(const std::string& file, std::string_view text);
config::KeyReference describe_rules();

}  // namespace loopwarden::workbench
