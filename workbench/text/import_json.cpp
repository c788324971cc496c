// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/import_json.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <cctype>

namespace loopwarden::workbench {
namespace {

using analysis::ArchivedSignal;
using analysis::ArchiveKind;

nlohmann::json percent(const ArchivedSignal& signal, const std::optional<double>& span) {
  if (signal.kind == ArchiveKind::none) return 0.0;
  if (!span || !(*span > 0.0) || !(signal.deviation > 0.0)) return nullptr;
  return 100.0 * signal.deviation / *span;
}

}  // namespace

nlohmann::json import_json(const record::ImportNotes& notes, const ImportSpans& spans,
                           std::optional<double> sees_from_percent) {
  const ArchiveKind kind = notes.pv.kind != ArchiveKind::none ? notes.pv.kind : notes.co.kind;
  nlohmann::json made = {
      {"period_s", notes.period_s},
      {"missing", notes.missing},
      {"resampled", !notes.resampled.empty()},
      {"how", notes.resampled.empty() ? nlohmann::json(nullptr) : nlohmann::json(notes.resampled)},
      {"compression",
       {{"kind", analysis::to_text(kind)},
        {"pv_percent", percent(notes.pv, spans.pv)},
        {"co_percent", percent(notes.co, spans.co)},
        {"pv_stored_share", notes.pv.stored_share},
        {"co_stored_share", notes.co.stored_share}}},
      {"sees_from_percent",
       sees_from_percent ? nlohmann::json(*sees_from_percent) : nlohmann::json(nullptr)},
      {"tag", notes.tag},
      {"start", notes.start
                    ? nlohmann::json(record::iso_text(notes.start->whole_s, notes.start->rest_s,
                                                      notes.start->zone_known))
                    : nlohmann::json(nullptr)},
      {"bad", notes.bad},
      {"questionable", notes.questionable},
      {"same_time", notes.same_time},
      {"remarks", notes.remarks}};
  made["words"] = nlohmann::json::array();
  for (const record::BadWord& one : notes.words) {
    made["words"].push_back(
        {{"file", one.file}, {"signal", one.signal}, {"word", one.word}, {"cells", one.cells}});
  }
  made["units"] = nlohmann::json::object();
  for (const record::Role role : {record::Role::pv, record::Role::co}) {
    const std::string& unit = notes.units[index_of(role)];
    if (!unit.empty()) made["units"][to_text(role)] = unit;
    if (const auto& range = notes.ranges[index_of(role)])
      made["ranges"][to_text(role)] = {range->first, range->second};
  }
  return made;
}

std::string file_name_for(const std::string& tag) {
  std::string name;
  for (const char c : tag) {
    const auto byte = static_cast<unsigned char>(c);
    name += std::isalnum(byte) != 0 || c == '-' || c == '.' || c == '_' || byte >= 0x80 ? c : '_';
  }
  constexpr std::size_t kLongest = 120;
  name.resize(std::min(name.size(), kLongest));
  // The name must not be that of a hidden file or of the folder itself.
  if (name.empty() || name.front() == '.') name.insert(name.begin(), '_');
  return name;
}

}  // namespace loopwarden::workbench
