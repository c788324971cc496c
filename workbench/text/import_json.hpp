// SPDX-License-Identifier: Apache-2.0
// Writes the findings and corrections of an import as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "record/import/constant_period.hpp"

namespace loopwarden::workbench {

// Spans in the units of the record. A share is null if its span is empty.
struct ImportSpans {
  std::optional<double> pv, co;
};
// Returns the object "import" of gap.json and diagnose. `sees_from_percent`: the smallest visible
// effect in such a record, % of the CO span; null: the archive has all values.
nlohmann::json import_json(const record::ImportNotes& notes, const ImportSpans& spans,
                           std::optional<double> sees_from_percent);

// Returns a name that is valid as a file name.
std::string file_name_for(const std::string& tag);

}  // namespace loopwarden::workbench
