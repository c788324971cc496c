// SPDX-License-Identifier: Apache-2.0
#include "workbench/report/palette.hpp"

namespace loopwarden::workbench {
namespace {

struct Property {
  const char* name;
  const char* light;
  const char* dark;
};

constexpr std::array kProperties{Property{"paper", palette::kPaper, "#14171b"},
                                 Property{"panel", palette::kPanel, "#1c2026"},
                                 Property{"ink", palette::kInk, "#e6e9ec"},
                                 Property{"soft", palette::kSoft, "#9aa5b1"},
                                 Property{"line", palette::kFrame, "#363d46"},
                                 Property{"grid", palette::kGrid, "#272d34"},
                                 Property{"measured", palette::kMeasured, "#e6e9ec"},
                                 Property{"before", palette::kBefore, "#ff8f45"},
                                 Property{"after", palette::kAfter, "#58b4f0"},
                                 Property{"sp", palette::kSetPoint, "#89939e"},
                                 Property{"shade", palette::kOrange, palette::kOrange},
                                 Property{"held", palette::kSoft, "#9aa5b1"},
                                 Property{"good", "#00724f", "#3cc79a"},
                                 Property{"bad", "#b23a00", "#ff8f5c"},
                                 Property{"open", palette::kBrown, "#e0b84a"},
                                 Property{"removed", "#fbe9df", "#43261a"},
                                 Property{"added", "#e0f0fa", "#12344a"}};

std::string root(const char* scheme, const char* Property::*colours) {
  std::string text = std::string(":root { color-scheme: ") + scheme + ";";
  for (const Property& p : kProperties) {
    text += std::string(" --") + p.name + ": " + p.*colours + ";";
  }
  return text + " }\n";
}

}  // namespace

std::string palette_style() {
  return root("light", &Property::light) + "@media screen and (prefers-color-scheme: dark) {\n" +
         root("dark", &Property::dark) + "}\n";
}

}  // namespace loopwarden::workbench
