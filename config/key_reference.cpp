// SPDX-License-Identifier: Apache-2.0
#include "config/key_reference.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "config/config_reader.hpp"
#include "config/effect_reader.hpp"
#include "config/loop_model_reader.hpp"

namespace loopwarden::config {
namespace {

// Markdown of headings, paragraphs, lists, code and `words`, so that docs/man/configuration.awk can
// make loopwardend.yaml(5) of it.
constexpr const char* kIntroduction = R"(# Configuration

<!-- Generated from the readers in config/; tests_config "[reference]" says how to renew it. -->

A configuration is a directory:

```
DIR/loopwardend.yaml     the daemon; may be absent, all its keys have defaults
DIR/loops.d/*.yaml       one control loop each
```

`loopwardend --config DIR --check` reads it as a start would and names every error with file, line
and column; `loopwarden check FILE...` does so for single files. `config/examples/` holds complete
examples, which the package has in `/usr/share/doc/loopwarden/examples/`.

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
`action` has no default, since a wrong guess is unsafe; nor has `comm_loss`, since only the device's own
watchdog can act when the cable is cut.

The enable contact is no safety function: an emergency stop must act in hardware.
)";

constexpr const char* kWiringNotes = R"(
What the manual of a device says about its registers goes into the loop's file like this:

```
register: {table: input, address: 10, type: f32, order: cdab}       # PV as a float
register: {table: input, address: 20, type: i16, raw: [0, 27648], eu: [0, 40]}
command: {address: 200, type: i16, raw: [0, 27648], eu: [0, 100]}   # CO in counts
```

- `raw` and `eu`: two values of the register, and what they mean in engineering units. The straight
  line through both goes on beyond them. `eu` may fall: with `raw: [0, 27648], eu: [100, 0]` the
  number falls as CO rises. `check` warns where `eu` does not cover the range of PV or of the output.
  `scale` and `offset` state the same line in another way (engineering value = raw * scale + offset);
  a register has one of the two.
- 27648 (hexadecimal 6C00) is what analog modules of Siemens SIMATIC S7 controllers count at the end of
  their nominal range: 0 to 27648 stand for 4 to 20 mA, 0 to 20 mA or 0 to 10 V, and -27648 for
  -10 V. Up to 32511 (117.6 %) is over-range, 32767 overflow; at 4 to 20 mA less than 4 mA counts
  below 0, -32768 is underflow. Hence `type: i16`: as `u16` the numbers below 0 would be large ones.
  Others count to 4095, 10000, 32767 or 65535: the device's manual says which.
- `address` counts from 0, as on the wire. Many manuals count from 1 and put the table in front: 40201,
  400201 and 4x0201 are holding register 200 (`table: holding`, `address: 200`), 30011 is input
  register 10 (`table: input`, `address: 10`). Where such a number can't be an address it is
  refused, and the message says what to write. 30001 to 39999 and 40001 to 49999 can be addresses, and
  some devices have registers there: they are taken as they stand, with a warning. In hexadecimal
  (`0x9D09` for 40201) it is an address that was meant, and there is no warning.
- `type`: `u16` (elsewhere UINT16, UINT, WORD), `i16` (INT16, INT), `u32` (UINT32, UDINT, DWORD), `i32`
  (INT32, DINT), `f32` (FLOAT32, FLOAT, REAL), `f64` (FLOAT64, DOUBLE, LREAL). Only the short words are
  taken; to the others the message answers with the right one.
- `order`: CDAB is `cdab`. A float that reads like 1e-40 or 1e+30 most often wants `cdab` or `abcd`
  instead of the other.
- 4-20 mA through a converter (`backend: analog`): `raw` are its numbers at 4 mA and at 20 mA, in place of
  `units_per_ma`, `scale` and `offset`; `range` says what these two currents mean.
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

// The mappings of a reference, each once, in the order of its keys.
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
  text += std::string("\n## Wiring by registers and counts\n") + kWiringNotes;
  text += "\n## A loop model\n" + to_markdown(describe_model());
  text += "\n## Effects\n\nOf a model's valve, process, transmitter, disturbances and faults.\n\n";
  return text + describe_effects();
}

}  // namespace loopwarden::config
