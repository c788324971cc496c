// SPDX-License-Identifier: Apache-2.0
#include "config/key_reference.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "config/config_reader.hpp"
#include "config/effect_reader.hpp"
#include "config/loop_model_reader.hpp"
#include "config/reference.hpp"

namespace loopwarden::config {
namespace {

std::string section_of(const std::string& path) {
  const std::size_t dot = path.rfind('.');
  return dot == std::string::npos ? std::string() : path.substr(0, dot);
}

std::string cell(const std::string& text) {
  std::string escaped;
  for (const char c : text) escaped += c == '|' ? std::string("\\|") : std::string(1, c);
  return escaped;
}

// Returns the mappings of a reference, each once, in the order of its keys.
std::vector<std::string> sections_of(const KeyReference& reference) {
  std::vector<std::string> sections;
  for (const KeyDescription& key : reference.keys()) {
    const std::string section = section_of(key.path);
    if (std::find(sections.begin(), sections.end(), section) == sections.end()) {
      sections.push_back(section);
    }
  }
  return sections;
}

std::string name_in(const std::string& section, const KeyDescription& key) {
  return section.empty() ? key.path : key.path.substr(section.size() + 1);
}

}  // namespace

void KeyReference::add(KeyDescription description) {
  const bool known = std::any_of(keys_.begin(), keys_.end(), [&](const KeyDescription& key) {
    return key.path == description.path;
  });
  if (!known) keys_.push_back(std::move(description));
}

std::string to_markdown(const KeyReference& reference) {
  std::string text;
  for (const std::string& section : sections_of(reference)) {
    if (!section.empty()) text += fmt::format("\n### `{}`\n", section);
    text += "\n| key | value | default | meaning |\n|---|---|---|---|\n";
    for (const KeyDescription& key : reference.keys()) {
      if (section_of(key.path) != section) continue;
      text += fmt::format("| `{}` | {} | {} | {} |\n", name_in(section, key), cell(key.value),
                          cell(key.fallback), cell(key.meaning));
    }
  }
  return text;
}

std::string describe_configuration() {
  std::string text = kIntroduction;
  text += "\n## The daemon: `loopwardend.yaml`\n" + to_markdown(describe_daemon());
  text += "\n## A loop: `loops.d/*.yaml`\n";
  text += kLoopNotes + to_markdown(describe_loop());
  text +=
      "\n## A loop that another controller runs: `control: "
      "elsewhere`\n\n[watch-a-loop.md](../how-to/watch-a-loop.md) is "
      "the guide.\n" +
      to_markdown(describe_watched_loop());
  text += std::string("\n## Wiring by registers and counts\n") + kWiringNotes;
  text += "\n## A loop model\n" + to_markdown(describe_model());
  text += "\n## Effects\n\nOf a model's valve, process, transmitter, disturbances and faults.\n\n";
  return text + describe_effects();
}

}  // namespace loopwarden::config
