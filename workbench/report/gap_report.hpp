// SPDX-License-Identifier: Apache-2.0
// report.html of the gap workflow: one page that needs nothing but itself.
#pragma once

#include <string>

#include "model/gap/result.hpp"

namespace loopwarden::workbench {

struct GapReportContext {
  std::string record;            // path, as given
  bool record_stays = true;      // false: the daemon takes it away
  std::string model;             // path, as given
  std::string model_text;        // the model file as given
  std::string corrected_text;    // model.corrected.yaml; empty where none was written
  std::string out;               // folder of the results
  std::string options{};         // further options of the command, as given; may be empty
  double seconds_of_work = 0.0;  // s
  std::string version;
};

// Takes any result, also one without series or of a record that was refused. Values that are not
// finite show as "-". Text from files is escaped.
std::string gap_report_html(const gap::Result& result, const GapReportContext& context);

// Share of the gap that can be closed and was: (before^2 - after^2) / (before^2 - floor^2), in
// percent, -100 to 100. NaN where before is not above the floor.
double gap_closed_percent(double before_rmse, double after_rmse, double floor_rmse);

}  // namespace loopwarden::workbench
