// SPDX-License-Identifier: Apache-2.0
// The scripts in snippets/, which CMakeLists.txt embeds in the program. Names between @ are
// replaced.
#pragma once

namespace loopwarden::workbench {

extern const char* const kMapIntroduction;    // map_introduction.md
extern const char* const kMapConditions;      // map_conditions.md
extern const char* const kMapThirdRegisters;  // map_third_registers.md
extern const char* const kReadPython;         // read.py
extern const char* const
    kNodeRedNodes;                     // node_red_nodes.json: common part of the nodes of each kind
extern const char* const kReadScript;  // read.sh
extern const char* const kReadJavaScript;  // read.js
extern const char* const kNodeRedDecode;   // node_red_decode.js
extern const char* const kNodeRedWrite;    // node_red_write.js

}  // namespace loopwarden::workbench
