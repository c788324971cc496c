// SPDX-License-Identifier: Apache-2.0
// Writes report.html of the gap workflow as one self-contained page.
#pragma once

#include <string>

#include "model/gap/result.hpp"

namespace loopwarden::workbench {

struct GapReportContext {
  std::string record;            // path, as given
  bool record_stays = true;      // false: the daemon deletes it
  std::string model;             // path, as given
  std::string model_text;        // the model file as given
  std::string corrected_text;    // model.corrected.yaml; empty if it was not written
  std::string out;               // folder of the results
  std::string options{};         // further options of the command, as given; may be empty
  double seconds_of_work = 0.0;  // s
  std::string version;
};

// Returns the page for any result, also for one without series or for a refused record. Values that
// are not finite appear as "-". Text from files is escaped.
std::string gap_report_html(const gap::Result& result, const GapReportContext& context);

// Returns the closed share of the RMS error above the floor in percent, -100 to 100:
// (before - after) / (before - floor). NaN if `before` is not above `floor`.
double gap_closed_percent(double before_rmse, double after_rmse, double floor_rmse);

}  // namespace loopwarden::workbench
