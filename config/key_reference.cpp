// SPDX-License-Identifier: Apache-2.0
#include "config/key_reference.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "config/config_reader.hpp"
#include "config/effect_reader.hpp"
#include "config/loop_model_reader.hpp"

namespace loopwarden::config {
namespace {

constexpr const char* kIntroduction = R"(# Configuration

<!-- Generated from the readers in config/; tests_config "[reference]" says how to renew it. -->

A configuration is a directory:

```
DIR/loopwardend.yaml     the daemon; may be absent, all its keys have defaults
DIR/loops.d/*.yaml       one control loop each
```

`loopwardend --config DIR --check` reads it as a start would and names every error with file, line
and column; `loopwarden check FILE...` does so for single files. `config/examples/` holds complete
examples.

Rules for all files:

- Keys that are unknown, double or missing are errors. So are anchors, tags, tabs in the
  indentation, more than one document, and files above 1 MiB.
- Numbers are decimal, finite and stand alone: the unit belongs to the key. Modbus addresses and
  masks may be hexadecimal (`0x10`).
- PV units are those of `process_variable.unit`, CO units those of `controller.output.unit`.
- Paths are relative to the file in which they stand.
)";

constexpr const char* kLoopNotes = R"(
The gains come in one of two forms, never mixed: the parallel form `kp`, `ki`, `kd`
(u = kp e + ki ∫e dt + kd de/dt), or the ISA standard form `kc` (or `pb`), `ti` (or `ti_min`), `td`.
`action` has no default, since a wrong guess is unsafe.

The enable contact is no safety function: an emergency stop must act in hardware.
)";

std::string section_of(const std::string& path) {
  const std::size_t dot = path.rfind('.');
  return dot == std::string::npos ? std::string() : path.substr(0, dot);
}

std::string cell(const std::string& text) {
  std::string escaped;
  for (const char c : text) escaped += c == '|' ? std::string("\\|") : std::string(1, c);
  return escaped;
}

}  // namespace

void KeyReference::add(KeyDescription description) {
  const bool known = std::any_of(keys_.begin(), keys_.end(), [&](const KeyDescription& key) {
    return key.path == description.path;
  });
  if (!known) keys_.push_back(std::move(description));
}

std::string to_markdown(const KeyReference& reference) {
  std::vector<std::string> sections;
  for (const KeyDescription& key : reference.keys()) {
    const std::string section = section_of(key.path);
    if (std::find(sections.begin(), sections.end(), section) == sections.end()) {
      sections.push_back(section);
    }
  }
  std::string text;
  for (const std::string& section : sections) {
    if (!section.empty()) text += fmt::format("\n### `{}`\n", section);
    text += "\n| key | value | default | meaning |\n|---|---|---|---|\n";
    for (const KeyDescription& key : reference.keys()) {
      if (section_of(key.path) != section) continue;
      const std::string name = section.empty() ? key.path : key.path.substr(section.size() + 1);
      text += fmt::format("| `{}` | {} | {} | {} |\n", name, cell(key.value), cell(key.fallback),
                          cell(key.meaning));
    }
  }
  return text;
}

std::string describe_configuration() {
  std::string text = kIntroduction;
  text += "\n## The daemon: `loopwardend.yaml`\n" + to_markdown(describe_daemon());
  text += "\n## A loop: `loops.d/*.yaml`\n";
  text += kLoopNotes + to_markdown(describe_loop());
  text += "\n## A loop model\n" + to_markdown(describe_model());
  text += "\n## Effects\n\nOf a model's valve, process, transmitter, disturbances and faults.\n\n";
  return text + describe_effects();
}

}  // namespace loopwarden::config
