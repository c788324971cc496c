// SPDX-License-Identifier: Apache-2.0
// What reading an export found and did, as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "record/import/constant_period.hpp"

namespace loopwarden::workbench {

// Spans in the units of the record; null stands where a share of them can't be told.
struct ImportSpans {
  std::optional<double> pv, co;
};
// The object "import" of gap.json and diagnose. `sees_from_percent`: the smallest effect that shows in such a record,
// % of the CO span; null: nothing was left out.
nlohmann::json import_json(const record::ImportNotes& notes, const ImportSpans& spans,
                           std::optional<double> sees_from_percent);

// A name that can be that of a file.
std::string file_name_for(const std::string& tag);

}  // namespace loopwarden::workbench
