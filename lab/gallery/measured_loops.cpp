// SPDX-License-Identifier: Apache-2.0
#include "lab/gallery/measured_loops.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "base/child_process.hpp"
#include "base/file.hpp"
#include "record/record_csv.hpp"
#include "workbench/report/chart.hpp"

namespace loopwarden::lab {
namespace {

struct DrawnLoop {
  const char* record;  // below the data's folder
  const char* loop;
  const char* what;
  double from_s;  // drawn part
  double to_s;
  const char* seen;
};

constexpr std::array kDrawnLoops{
    DrawnLoop{"measured/rse_0412_fcv701.csv", "RSE FCV701", "flow", 500.0, 1340.0,
              "CO is a triangle of 68 to 74 %, logged in steps of 1 %. PV jumps between two "
              "constant levels, and CO turns after each jump. The valve sticks."},
    DrawnLoop{"isdb/CHEM10.csv", "CHEM10", "pressure", 0.0, 500.0,
              "CO rises and falls linearly. PV has two constant levels with sharp corners. PV over "
              "CO is a parallelogram. The valve sticks."},
    DrawnLoop{"isdb/CHEM24.csv", "CHEM24", "flow", 6000.0, 9000.0,
              "PV has many constant levels and keeps each one while CO travels by 20 %. Smaller "
              "swings of CO do not move PV. The cycle is irregular, but the band is constant. The "
              "valve sticks."},
    DrawnLoop{"isdb/CHEM1.csv", "CHEM1", "flow", 0.0, 700.0,
              "CO travels 0.7 % between its turns and turns after PV has changed level. PV is a "
              "square wave with noise. The valve sticks, in a small band."},
    DrawnLoop{"isdb/CHEM12.csv", "CHEM12", "level", 0.0, 2000.0,
              "PV changes in steps and rests in between. CO ramps and turns after each step, "
              "always after the same travel. The record has more noise than the others but the "
              "same shape. The valve sticks."},
    DrawnLoop{"isdb/CHEM2.csv", "CHEM2", "flow", 0.0, 1000.0,
              "PV follows CO with the same slope in both directions. At each turn it stays "
              "constant until CO has moved back by 2 to 3 %: a dead band. PV does not jump; "
              "backlash looks the same."},
    DrawnLoop{"routine/r22.csv", "B of routine, window r22", "type unknown", 2500.0, 5000.0,
              "PV jumps by 10 to 15 between two levels while CO moves by 0.6 %; sharp corners. The "
              "valve sticks."},
    DrawnLoop{
        "measured/rse_0412_fcv721.csv", "RSE FCV721", "flow", 500.0, 1400.0,
        "Levels and jumps as those of FCV701 on the same header. PV also steps while CO is "
        "constant, when a neighbour jumps. The valve sticks, and the neighbour disturbs the loop."},
    DrawnLoop{"measured/rse_1704_tcv731.csv", "RSE TCV731", "temperature", 1000.0, 2000.0,
              "CO moves between its limits and rests at both. PV is round and lags by a quarter "
              "period, as in a slow process. The gain is too high; the valve can't be judged."},
    DrawnLoop{"isdb/PAP4.csv", "PAP4", "concentration", 400.0, 700.0,
              "CO and PV move together in a narrow ellipse, and PV never rests. The data base "
              "lists dead zone and tight tuning; only the tuning is visible."},
    DrawnLoop{"isdb/CHEM13.csv", "CHEM13", "analyser", 12000.0, 18000.0,
              "CO and PV are round and opposite, and PV over CO is a straight line: the controller "
              "reacts to a disturbance or a faulty analyser, and the valve follows."},
    DrawnLoop{
        "routine/r24.csv", "A of routine, window r24", "level", 3000.0, 7500.0,
        "Three steps of the set point. CO kicks, PV turns and overshoots, all smooth: a vessel "
        "that integrates. The plant calls the valve sticky; this window does not show it."},
};

// Returns the output of the program.
std::string printed(const std::filesystem::path& program,
                    const std::vector<std::string>& arguments) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw std::system_error(errno, std::generic_category(), "pipe");
  }
  const base::File from(ends[0]);
  base::File to(ends[1]);
  base::ChildProcess child(program.string(), arguments, {.output = to.fd(), .idle = false});
  to.close();
  const std::optional<std::string> text = from.read(std::size_t{1} << 20U);
  std::optional<int> code;
  while (!(code = child.ended())) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  if (!text || *code != 0) {
    throw std::runtime_error(fmt::format("{} {}: exit code {}: {}", program.string(),
                                         fmt::join(arguments, " "), *code, text.value_or("")));
  }
  return *text;
}

// Returns the verdict, its reasons, and the advice to settle it.
std::string said(const std::string& text) {
  std::string result = text.substr(0, text.find('\n'));
  for (const std::string_view wanted : {"because: ", "next step to decide: "}) {
    const std::size_t at = text.find("\n" + std::string(wanted));
    if (at == std::string::npos) continue;
    const std::size_t end = text.find('\n', at + 1);
    result += "; " + text.substr(at + 1, end - at - 1);
  }
  return result;
}

std::string picture_of(const DrawnLoop& drawn, const record::Record& r) {
  const auto at = [&](double time_s) {
    return std::lower_bound(r.time_s.begin(), r.time_s.end(), time_s) - r.time_s.begin();
  };
  const auto cut = [&](const std::vector<double>& column) {
    return std::vector<double>(column.begin() + at(drawn.from_s), column.begin() + at(drawn.to_s));
  };
  const std::vector<double> time = cut(r.time_s);
  workbench::Chart pv{.title = "PV", .x_label = "s", .y_label = "PV", .height = 190.0};
  if (!r.sp.empty())
    pv.lines.push_back({"SP", workbench::palette::kSetPoint, time, cut(r.sp), true});
  pv.lines.push_back({!r.sp.empty() ? "PV" : "", workbench::palette::kBlue, time, cut(r.pv)});
  workbench::Chart co{.title = "CO", .x_label = "s", .y_label = "CO", .height = 190.0};
  co.lines = {{"", workbench::palette::kVermilion, time, cut(r.co)}};
  const double below = workbench::chart_height(pv);
  const double high = below + workbench::chart_height(co);
  workbench::Chart plane{.title = "PV over CO",
                         .x_label = "CO",
                         .y_label = "PV",
                         .width = 360.0,
                         .height = high - 40.0};
  plane.lines = {{"", workbench::palette::kBlue, cut(r.co), cut(r.pv)}};
  return workbench::sheet_svg(fmt::format("{}, {}", drawn.loop, drawn.what), pv.width + plane.width,
                              workbench::kSheetTitle + high,
                              workbench::chart_group(pv, 0.0, workbench::kSheetTitle) +
                                  workbench::chart_group(co, 0.0, workbench::kSheetTitle + below) +
                                  workbench::chart_group(plane, pv.width, workbench::kSheetTitle));
}

}  // namespace

std::vector<MeasuredLoop> measured_loops(const std::filesystem::path& data,
                                         const std::filesystem::path& program) {
  std::vector<MeasuredLoop> loops;
  for (const DrawnLoop& drawn : kDrawnLoops) {
    const std::filesystem::path path = data / drawn.record;
    const record::Record r = record::read_record(path);
    loops.push_back({.file = path.stem().string(),
                     .title = fmt::format("{} ({})", drawn.loop, drawn.what),
                     .seen = drawn.seen,
                     .said = said(printed(program, {"diagnose", path.string()})),
                     .picture = picture_of(drawn, r)});
  }
  return loops;
}

}  // namespace loopwarden::lab
